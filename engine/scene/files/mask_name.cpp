#include "scene/files/mask_name.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "image/picture_type.h"
#include "scene/files/dataset_places.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

constexpr std::array<std::string_view, 3> kMaskWords{"masks", "mask", "msk"};

bool separates(char c) { return c == '.' || c == '_' || c == '-' || c == ' '; }

/// Removes "_mask" and the like from the end of a key, or "mask_" from its beginning. Returns whether it was there.
bool strip_mark(std::string& key, bool& dynamic) {
  for (const std::string_view word : kMaskWords) {
    if (key.size() > word.size() + 1 && key.ends_with(word) && separates(key[key.size() - word.size() - 1])) {
      key.resize(key.size() - word.size() - 1);
      return true;
    }
    for (const std::string_view before : {"dynamic_", "dynamic-", ""}) {
      const std::string mark = std::string(before) + std::string(word);
      if (key.size() <= mark.size() + 1 || !key.starts_with(mark) || !separates(key[mark.size()])) continue;
      dynamic = !before.empty();
      key.erase(0, mark.size() + 1);
      return true;
    }
  }
  return false;
}

}  // namespace

MaskName mask_name(const std::string& file_name) {
  MaskName result;
  const auto add = [&](const std::string& key) {
    for (const std::string& name : {key, picture_stem(key)})
      if (std::find(result.photographs.begin(), result.photographs.end(), name) == result.photographs.end())
        result.photographs.push_back(name);
  };
  std::string key = name_key(picture_stem(file_name));
  add(key);
  result.marked = strip_mark(key, result.dynamic);
  if (result.marked) add(key);
  return result;
}

bool is_mask_file_name(const fs::path& name) {
  return is_readable_picture_name(name) || name_key(name.extension().string()) == ".mask";
}

int mask_folder_reduction(const std::string& key) {
  for (const std::string_view word : kMaskWords) {
    if (!key.starts_with(word) || key.size() < word.size() + 2 || key.size() > word.size() + 3) continue;
    const std::string number = key.substr(word.size() + 1);
    const bool digits = std::all_of(number.begin(), number.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
    if (separates(key[word.size()]) && digits) return std::stoi(number);
  }
  return 0;
}

MaskFolderKind mask_folder_kind(const std::string& key) {
  // dynamic_masks and segmentation are LichtFeld Studio's; the others are what people name such folders.
  constexpr std::array<std::string_view, 19> firm{
      "masks",        "mask",          "msk",         "images_masks", "images_mask",      "image_masks",
      "image_mask",   "mask_image",    "mask_images", "masks_images", "foreground_masks", "fg_masks",
      "object_masks", "dynamic_masks", "alpha_masks", "binary_masks", "input_masks",      "segmentation_masks",
      "masks_png"};
  constexpr std::array<std::string_view, 10> loose{"segmentation", "segmentations", "seg",   "segs",
                                                   "matte",        "mattes",        "alpha", "alphas",
                                                   "silhouette",   "silhouettes"};
  if (mask_folder_reduction(key) > 0 || std::find(firm.begin(), firm.end(), key) != firm.end())
    return MaskFolderKind::firm;
  if (std::find(loose.begin(), loose.end(), key) != loose.end()) return MaskFolderKind::loose;
  return key.find("mask") != std::string::npos ? MaskFolderKind::other : MaskFolderKind::none;
}

fs::path masks_beside(const fs::path& photographs) {
  const auto in = [](const fs::path& folder) {
    for (const std::string_view name : kMaskWords)
      if (fs::path masks = folder_named(folder, name); !masks.empty()) return masks;
    return fs::path();
  };
  const auto is_picture_folder = [](const fs::path& folder) {
    const std::string key = name_key(folder.filename().string());
    const auto names = picture_folder_names();
    return std::find(names.begin(), names.end(), key) != names.end();
  };
  if (fs::path masks = in(photographs); !masks.empty()) return masks;
  const fs::path parent = photographs.parent_path();
  if (is_picture_folder(photographs)) return in(parent);
  if (!is_picture_folder(parent)) return {};
  // images/front: masks/front, or masks/ for all.
  const fs::path masks = in(parent.parent_path());
  const fs::path part = masks.empty() ? fs::path() : folder_named(masks, name_key(photographs.filename().string()));
  return part.empty() ? masks : part;
}

}  // namespace trisoup::scene
