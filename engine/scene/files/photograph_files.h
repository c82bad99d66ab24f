// Finds the photograph and the mask of a frame on disk.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/picture_tree.h"

namespace trisoup::scene {

struct PhotographFile {
  std::string name;  // relative to the dataset, with extension; the same whether or not `file` is prescaled
  std::filesystem::path file;
  bool prescaled = false;      // from images_2, images_4 or images_8, so it must not be shrunk again
  bool by_name = false;        // found by its name, not at its path
  bool by_name_alone = false;  // and no folder of the path is that of the file
};

/// Returns a path of a dataset in normal form, so that two spellings of one path compare equal: ./ and inner ../ are
/// resolved, backslashes become slashes, and URLs of files become paths.
std::string normal_path(const std::string& path);

/// Returns whether a path is absolute on any system: /home/..., C:\..., C:/...
bool is_absolute_path(const std::string& path);

class PhotographFiles {
 public:
  /// root: the dataset's folder. downscale: with exactly 2, 4 or 8, photographs in images/ are replaced by those in
  /// images_2/, images_4/ or images_8/ beside it if they exist. outside: paths may leave the root.
  PhotographFiles(std::filesystem::path root, double downscale, bool outside = false);

  /// Finds a photograph by its path, relative to the root or absolute. An image extension may be missing.
  /// If there is no such file, takes the photograph below the root whose name and folders agree with the longest ending
  /// of the path, whatever the letter case and the Unicode form. A name without its extension counts if no whole name
  /// does. Between equals, those in the usual folders of photographs come first; others are no match, and their paths
  /// are written to `candidates`. If the folder of the path exists, no other folder is searched: the photograph is
  /// missing. Folders of masks and depth maps are not searched, and reduced copies come
  /// last.
  /// Returns nullopt if no file is found. Throws Error if the path leaves the root.
  std::optional<PhotographFile> find(const std::string& path, std::vector<std::string>* candidates = nullptr) const;
  /// Describes the places that find() searches, for messages.
  std::string looked_for(const std::string& path) const;

  /// Finds another file of the dataset by its path: as it stands, or at its endings below the root and below images/.
  /// Returns nullopt if there is none. Throws Error if the path leaves the root.
  std::optional<std::filesystem::path> find_file(const std::string& path) const;

  /// Finds a mask by its path: as it stands, or as in find() among the pictures in folders of masks and those whose
  /// names say that they are masks. Returns nullopt if there is none. Throws Error if the path leaves the root.
  std::optional<std::filesystem::path> find_listed_mask(const std::string& path) const;

  /// Returns whether two folders, relative to the root, hold pictures with the same names, as photographs and copies of
  /// them do. A photograph that is missing in one must not be replaced by one of the other.
  bool are_parallel(const std::filesystem::path& a, const std::filesystem::path& b) const;

  const std::filesystem::path& root() const { return root_; }
  double downscale() const { return downscale_; }

 private:
  using Take = std::function<bool(const std::filesystem::path& place, bool by_name)>;
  /// Calls `take` for the place below the root to which a path leads as it stands. Returns whether that took it.
  bool as_it_stands(const std::string& path, const Take& take) const;
  /// Calls `take` for each ending of a path, longest first, until it returns true. Returns whether it did.
  bool each_ending(const std::string& path, const Take& take) const;
  std::optional<PhotographFile> at(const std::filesystem::path& relative) const;
  /// Returns the picture below the root that agrees best with a path, or nullptr. masks: searches for a mask instead.
  const TreePicture* by_name(const std::string& path, bool masks, std::vector<std::string>* candidates) const;
  const PictureTree& tree() const;

  std::filesystem::path root_;
  double downscale_ = 1;
  bool outside_ = false;
  std::string prescaled_;                      // name of the folders of prescaled copies; empty: none
  mutable std::unique_ptr<PictureTree> tree_;  // made at first use
};

}  // namespace trisoup::scene
