// Where the photograph and the mask of a frame lie on disk.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace trisoup::scene {

/// Whether a name ends as those of PNG and JPEG files do, in letters of either case.
bool is_photograph_name(const std::filesystem::path& name);

struct PhotographFile {
  std::string name;  // relative to the dataset, with extension; the same whether or not `file` is prescaled
  std::filesystem::path file;
  bool prescaled = false;  // from images_2, images_4 or images_8: no resampling is left to do
};

class PhotographFiles {
 public:
  /// `root` is the dataset folder. With a `downscale` of exactly 2, 4 or 8, photographs in images/ are taken from
  /// images_2/, images_4/ or images_8/ where they are there.
  PhotographFiles(std::filesystem::path root, double downscale);

  /// The file of a photograph by its path relative to the root (or absolute); an image extension may be missing. Nothing
  /// if there is no such file.
  std::optional<PhotographFile> find(const std::string& path) const;

  /// The mask of a photograph by its name: masks/<name>, masks/<name>.png or, with the extension replaced, masks/<stem>.png,
  /// where <name> is without a leading images/. Empty if there is none.
  std::filesystem::path find_mask(const std::string& name) const;

 private:
  std::filesystem::path root_;
  std::filesystem::path prescaled_folder_;  // relative; empty: none
  bool has_masks_ = false;
};

}  // namespace trisoup::scene
