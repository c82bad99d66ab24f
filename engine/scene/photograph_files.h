// Where the photograph and the mask of a frame lie on disk.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace trisoup::scene {

/// Whether a name ends as those of PNG, JPEG, WebP and TIFF files do, in letters of either case.
bool is_photograph_name(const std::filesystem::path& name);

struct PhotographFile {
  std::string name;  // relative to the dataset, with extension; the same whether or not `file` is prescaled
  std::filesystem::path file;
  bool prescaled = false;  // from images_2, images_4 or images_8: no resampling is left to do
  bool by_name = false;    // not where its path says: found by its name
};

/// A path as datasets write it, by which two that mean one file are the same: without ./ and ../ within, back-slashes
/// of Windows turned.
std::string normal_path(const std::string& path);

/// Whether a path names a place on a machine, this one or another: /home/..., C:\..., C:/...
bool is_absolute_path(const std::string& path);

class PhotographFiles {
 public:
  /// `root` is the dataset folder. With a `downscale` of exactly 2, 4 or 8, photographs in images/ are taken from
  /// images_2/, images_4/ or images_8/ where they are there. `outside`: paths may leave the root.
  PhotographFiles(std::filesystem::path root, double downscale, bool outside = false);

  /// The file of a photograph by its path relative to the root (or absolute); an image extension may be missing. Where
  /// nothing is there and the path is another machine's (absolute, with back-slashes, or beyond the root), the file
  /// below the root, or below images/, that has the longest tail of the path; failing that, the only photograph below
  /// the root that has the name (those in masks/ and images_2/, images_4/, images_8/ are not looked at). Nothing if
  /// there is no such file. Throws Error where the path leaves the root.
  std::optional<PhotographFile> find(const std::string& path) const;
  /// What find() looked for, for a message.
  std::string looked_for(const std::string& path) const;

  /// Another file of the dataset by its path, in the same places but the last. Nothing if there is none; throws Error
  /// where it leaves the root.
  std::optional<std::filesystem::path> find_file(const std::string& path) const;

  /// The mask of a photograph by its name: masks/<name>, masks/<name>.png or, with the extension replaced,
  /// masks/<stem>.png, where <name> is without a leading images/. Empty if there is none.
  std::filesystem::path find_mask(const std::string& name) const;

 private:
  using Take = std::function<bool(const std::filesystem::path& place, bool by_name)>;
  /// Calls `take` for the places below the root where a file of that path may be, until it says true.
  bool each_place(const std::string& path, const Take& take) const;
  std::optional<PhotographFile> at(const std::filesystem::path& relative) const;
  std::optional<PhotographFile> only_one_named(const std::string& name) const;

  std::filesystem::path root_;
  bool outside_ = false;
  mutable std::optional<std::multimap<std::string, std::filesystem::path>>
      by_name_;                             // photographs below the root, by name with and without extension
  std::filesystem::path prescaled_folder_;  // relative; empty: none
  bool has_masks_ = false;
};

}  // namespace trisoup::scene
