// Finds the photograph and the mask of a frame on disk.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace trisoup::scene {

/// Returns whether a name has an extension of PNG, JPEG, WebP or TIFF files, in upper or lower case.
bool is_photograph_name(const std::filesystem::path& name);

struct PhotographFile {
  std::string name;  // relative to the dataset, with extension; the same whether or not `file` is prescaled
  std::filesystem::path file;
  bool prescaled = false;  // from images_2, images_4 or images_8, so it must not be shrunk again
  bool by_name = false;    // found by its name, not at its path
};

/// Returns a path of a dataset in normal form, so that two spellings of one path compare equal: ./ and inner ../ are
/// resolved, and backslashes become slashes.
std::string normal_path(const std::string& path);

/// Returns whether a path is absolute on any system: /home/..., C:\..., C:/...
bool is_absolute_path(const std::string& path);

class PhotographFiles {
 public:
  /// root: the dataset's folder. downscale: with exactly 2, 4 or 8, photographs in images/ are replaced by those in
  /// images_2/, images_4/ or images_8/ if they exist. outside: paths may leave the root.
  PhotographFiles(std::filesystem::path root, double downscale, bool outside = false);

  /// Finds a photograph by its path, relative to the root or absolute. An image extension may be missing.
  /// If there is no such file and the path may come from another machine (absolute, with backslashes, or outside the
  /// root), searches below the root and below images/ for the longest ending of the path. If that fails too, uses the
  /// only photograph below the root with that name, except in masks/, images_2/, images_4/ and images_8/.
  /// Returns nullopt if no file is found. Throws Error if the path leaves the root.
  std::optional<PhotographFile> find(const std::string& path) const;
  /// Describes the places that find() searches, for messages.
  std::string looked_for(const std::string& path) const;

  /// Finds another file of the dataset by its path, in the same places as find() but not by its name alone. Returns
  /// nullopt if there is none. Throws Error if the path leaves the root.
  std::optional<std::filesystem::path> find_file(const std::string& path) const;

  /// Finds the mask of a photograph: masks/<name>, masks/<name>.png or, with the extension replaced, masks/<stem>.png,
  /// where <name> omits a leading images/. Empty if there is none.
  std::filesystem::path find_mask(const std::string& name) const;

 private:
  using Take = std::function<bool(const std::filesystem::path& place, bool by_name)>;
  /// Calls `take` for each place below the root where the file of a path may be, until it returns true. Returns whether
  /// it did.
  bool each_place(const std::string& path, const Take& take) const;
  std::optional<PhotographFile> at(const std::filesystem::path& relative) const;
  std::optional<PhotographFile> only_one_named(const std::string& name) const;

  std::filesystem::path root_;
  bool outside_ = false;
  /// Photographs below the root, by name with and without extension. Filled at first use.
  mutable std::optional<std::multimap<std::string, std::filesystem::path>> by_name_;
  std::filesystem::path prescaled_folder_;  // relative to the root; empty: none
  bool has_masks_ = false;
};

}  // namespace trisoup::scene
