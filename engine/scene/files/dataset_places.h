// Where programs put the parts of a dataset: COLMAP models, folders of photographs.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trisoup::scene {

/// Names of folders that hold photographs, most usual first, lower case.
std::span<const std::string_view> picture_folder_names();

/// Returns the folder with this name in any letter case, or an empty path. An exact match comes first. name: lower case
/// letters.
std::filesystem::path folder_named(const std::filesystem::path& parent, std::string_view name);

/// Returns whether a folder, or with `below` a folder up to 3 levels below, holds a photograph.
bool holds_pictures(const std::filesystem::path& folder, bool below = false);

/// Returns the file with poses in the format of instant-ngp and nerfstudio in a folder: transforms.json in any letter
/// case, else the only JSON file that lists frames with matrices. Empty if there is none.
std::filesystem::path transforms_file(const std::filesystem::path& folder);

/// Returns whether a folder has the files of a COLMAP model: images and cameras, binary or text.
bool is_colmap_model(const std::filesystem::path& folder);

/// Returns the folders of a dataset's COLMAP models, all from the first of these places that has any:
/// sparse/0, sparse, sparse/1 and so on; the folder itself; dense/sparse, dense/0/sparse and undistorted/sparse
/// (image_undistorter, automatic_reconstructor); colmap/sparse/0 (nerfstudio), colmap_sparse, colmap_text
/// (instant-ngp); distorted/sparse/0 (convert.py of 3D Gaussian Splatting), whose lenses do not fit undistorted
/// photographs. Else a model up to 4 levels below. Folders made by reconstruct() are left out.
std::vector<std::filesystem::path> colmap_models_in(const std::filesystem::path& root);

/// Returns whether all of these are models of one reconstruction, in numbered folders of one parent.
bool is_one_reconstruction(const std::vector<std::filesystem::path>& models);

/// Returns the folder of the dataset that `path` is part of: an ancestor if `path` is only a folder of photographs or
/// a COLMAP model in a dataset, else `path`.
std::filesystem::path dataset_root(const std::filesystem::path& path);

/// Returns the folder relative to `root` to which the names in a COLMAP model refer, with a slash at its end; empty for
/// the root. Folders nearer to the model come first: dense/images before images for dense/sparse.
std::string colmap_picture_folder(const std::filesystem::path& root, const std::filesystem::path& model);

}  // namespace trisoup::scene
