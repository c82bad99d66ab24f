#include "scene/files/dataset_places.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>

#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

/// The record of reconstruct(), whose folders have another way into a training.
constexpr const char* kReconstructRecord = "made_from.json";

bool is_real_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// Returns whether the beginning of a JSON file lists frames with matrices.
bool lists_frames(const fs::path& file) {
  constexpr std::size_t kHead = 1 << 16;
  std::string head(kHead, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  return head.find("\"frames\"") != std::string::npos && head.find("\"transform_matrix\"") != std::string::npos;
}

bool has_images_file(const fs::path& folder) {
  return is_file(folder / "images.bin") || is_file(folder / "images.txt");
}

bool is_numeral(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// Returns the folders in a folder that are not hidden. Numbers come first, in their order.
std::vector<fs::path> folders_in(const fs::path& folder) {
  std::vector<fs::path> result;
  std::error_code problem;
  fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem))
    if (is_real_folder(entry->path()) && !entry->path().filename().string().starts_with('.'))
      result.push_back(entry->path());
  std::sort(result.begin(), result.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.filename().string(), y = b.filename().string();
    const bool number = is_numeral(x);
    if (number != is_numeral(y)) return number;
    return number && x.size() != y.size() ? x.size() < y.size() : x < y;
  });
  return result;
}

/// Returns the models in a folder such as sparse/: 0, the folder itself, and the other folders in it.
std::vector<fs::path> models_of(const fs::path& folder) {
  std::vector<fs::path> models;
  if (has_images_file(folder / "0")) models.push_back(folder / "0");
  if (has_images_file(folder)) models.push_back(folder);
  for (const fs::path& inner : folders_in(folder))
    if (inner.filename() != "0" && is_colmap_model(inner)) models.push_back(inner);
  return models;
}

void find_below(const fs::path& folder, int depth, std::vector<fs::path>& models) {
  if (is_file(folder / kReconstructRecord)) return;
  if (is_colmap_model(folder)) models.push_back(folder);
  if (depth == 0) return;
  for (const fs::path& inner : folders_in(folder))
    if (!fs::is_symlink(inner)) find_below(inner, depth - 1, models);
}

std::vector<fs::path> models_in_usual_places(const fs::path& root) {
  if (std::vector<fs::path> models = models_of(root / "sparse"); !models.empty()) return models;
  if (has_images_file(root)) return {root};
  for (const char* place :
       {"dense", "dense/0", "undistorted", "undistorted/sparse", "dense/sparse", "dense/0/sparse", "colmap/dense",
        "colmap/dense/0", "colmap/sparse", "colmap", "colmap_sparse", "colmap_text", "distorted/sparse"}) {
    if (is_file(root / *fs::path(place).begin() / kReconstructRecord)) continue;
    std::vector<fs::path> models = models_of(root / place);
    std::erase_if(models, [](const fs::path& model) { return !is_colmap_model(model); });
    if (!models.empty()) return models;
  }
  return {};
}

bool has_own_poses(const fs::path& root) {
  return is_file(root / "transforms_train.json") || !transforms_file(root).empty() ||
         !models_in_usual_places(root).empty();
}

/// Returns whether a folder's name is that of a part of a dataset.
bool is_part_of_dataset(const fs::path& folder) {
  const std::string key = name_key(folder.filename().string());
  for (const std::string_view name : picture_folder_names())
    if (key == name || (key.starts_with(name) && key[name.size()] == '_' && is_numeral(key.substr(name.size() + 1))))
      return true;
  for (const char* name : {"sparse", "dense", "undistorted", "distorted", "colmap", "masks", "mask"})
    if (key == name) return true;
  return is_numeral(key);
}

/// Returns the known folder of photographs in `folder`, or an empty path. first: the name to try first.
fs::path picture_folder_in(const fs::path& folder, std::string_view first) {
  if (const fs::path named = folder_named(folder, first); !named.empty() && holds_pictures(named, true)) return named;
  for (const std::string_view name : picture_folder_names())
    if (const fs::path named = folder_named(folder, name); !named.empty() && holds_pictures(named, true)) return named;
  return {};
}

}  // namespace

std::span<const std::string_view> picture_folder_names() {
  static constexpr std::array<std::string_view, 18> names{
      "images",     "input",  "image",  "rgb",      "imgs",  "img",     "color",       "colour",
      "colors",     "frames", "photos", "pictures", "photo", "picture", "undistorted", "undistorted_images",
      "images_jpg", "source"};
  return names;
}

fs::path folder_named(const fs::path& parent, std::string_view name) {
  if (is_real_folder(parent / name)) return parent / name;
  for (const fs::path& folder : folders_in(parent))
    if (name_key(folder.filename().string()) == name) return folder;
  return {};
}

bool holds_pictures(const fs::path& folder, bool below) {
  std::error_code problem;
  fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    const fs::path name = entry->path().filename();
    if (!name.string().starts_with('.') && is_readable_picture_name(name) && is_file(entry->path())) return true;
  }
  if (!below) return false;
  for (const fs::path& inner : folders_in(folder)) {
    if (holds_pictures(inner)) return true;
    for (const fs::path& innermost : folders_in(inner))
      if (holds_pictures(innermost)) return true;
  }
  return false;
}

fs::path transforms_file(const fs::path& folder) {
  if (is_file(folder / "transforms.json")) return folder / "transforms.json";
  std::vector<fs::path> lists;
  std::error_code problem;
  fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    const fs::path& file = entry->path();
    const std::string key = name_key(file.filename().string());
    if (key == "transforms.json" && is_file(file)) return file;
    if (key.ends_with(".json") && !key.starts_with('.') && is_file(file) && lists_frames(file)) lists.push_back(file);
  }
  return lists.size() == 1 ? lists.front() : fs::path();
}

bool is_colmap_model(const fs::path& folder) {
  return (is_file(folder / "images.bin") && is_file(folder / "cameras.bin")) ||
         (is_file(folder / "images.txt") && is_file(folder / "cameras.txt"));
}

std::vector<fs::path> colmap_models_in(const fs::path& root) {
  std::vector<fs::path> models = models_in_usual_places(root);
  if (!models.empty()) return models;
  find_below(root, 4, models);
  // Photographs without poses are not those of another dataset that lies among them.
  if (holds_pictures(root) || holds_pictures(root / "images"))
    std::erase_if(models, [&](const fs::path& model) {
      const fs::path pictures = colmap_picture_folder(root, model), inside = model.lexically_relative(root);
      return !pictures.empty() && *pictures.begin() == *inside.begin();
    });
  return models;
}

bool is_one_reconstruction(const std::vector<fs::path>& models) {
  return std::all_of(models.begin(), models.end(), [&](const fs::path& model) {
    return model.parent_path() == models.front().parent_path() || model.parent_path() == models.front() ||
           model == models.front().parent_path();
  });
}

fs::path dataset_root(const fs::path& path) {
  if (!is_real_folder(path)) return path;
  const bool model = is_colmap_model(path) && !is_file(path / "transforms_train.json") &&
                     transforms_file(path).empty() && !holds_pictures(path, true);
  if (!model && has_own_poses(path)) return path;
  std::error_code ignored;
  fs::path above = fs::absolute(path, ignored).lexically_normal();
  if (!above.has_filename()) above = above.parent_path();
  constexpr int kMostLevels = 4;
  for (int i = 0; i < kMostLevels && is_part_of_dataset(above); ++i) {
    above = above.parent_path();
    if (model ? !picture_folder_in(above, "images").empty() || holds_pictures(above) : has_own_poses(above))
      return above;
  }
  return path;
}

std::string colmap_picture_folder(const fs::path& root, const fs::path& model) {
  const fs::path inside = model.lexically_normal().lexically_relative(root.lexically_normal());
  const std::string first = inside.empty() ? std::string(".") : name_key(inside.begin()->string());
  if (first == "." || first == "sparse")
    for (const char* images : {"images", "images_2", "images_4", "images_8"})
      if (is_real_folder(root / images)) return "images/";
  std::vector<fs::path> above{fs::path()};
  if (first != "." && first != "..")
    for (const fs::path& part : inside) above.push_back(above.back() / part);
  for (auto folder = above.rbegin(); folder != above.rend(); ++folder)
    if (const fs::path found = picture_folder_in(root / *folder, first == "distorted" ? "input" : "images");
        !found.empty())
      return found.lexically_normal().lexically_relative(root.lexically_normal()).generic_string() + "/";
  return {};
}

}  // namespace trisoup::scene
