#include "scene/datasets/unposed.h"

#include <algorithm>
#include <cctype>
#include <set>

#include <fmt/format.h>

#include "base/printable.h"
#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/datasets/dataset.h"
#include "scene/files/dataset_places.h"
#include "scene/files/mask_name.h"
#include "scene/files/picture_tree.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

bool is_for_colmap(const fs::path& name) {
  const PictureType* type = picture_type_of_name(name);
  return is_readable_picture_name(name) && type && type->read_by_colmap;
}

bool is_picture(const fs::path& name) { return is_readable_picture_name(name) || is_unread_picture_name(name); }

/// Returns the names of the files in a folder that are not hidden, sorted. Some systems create a hidden file with the
/// same extension for each photograph.
std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code problem;
  fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with('.') && is_file(entry->path())) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// Returns the folders that may hold photographs without poses, in the order in which they are searched.
std::vector<fs::path> places_in(const fs::path& path) {
  std::vector<fs::path> places{path / "images", path};
  for (const std::string_view name : picture_folder_names())
    if (fs::path folder = folder_named(path, name); !folder.empty() && folder != places[0]) places.push_back(folder);
  return places;
}

/// Returns the subfolders that hold photographs directly, up to 3 levels below, sorted.
std::vector<fs::path> folders_with_photographs(const fs::path& folder) {
  constexpr int kDeepest = 2;
  std::vector<fs::path> found;
  std::error_code problem;
  fs::recursive_directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::recursive_directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    std::error_code ignored;
    if (!entry->is_directory(ignored)) continue;
    const std::string key = name_key(entry->path().filename().string());
    if (key.starts_with('.') || is_aside_folder(key) || mask_folder_kind(key) != MaskFolderKind::none ||
        entry.depth() >= kDeepest)
      entry.disable_recursion_pending();
    if (key.starts_with('.') || is_aside_folder(key) || mask_folder_kind(key) != MaskFolderKind::none) continue;
    if (!photographs_in(entry->path()).empty()) found.push_back(entry->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string skipped_note(const fs::path& folder) {
  const std::vector<std::string> others = unread_pictures_in(folder);
  if (others.empty()) return {};
  std::string remedy = picture_converter(others.front());
  if (remedy.empty()) remedy = "convert with heif-convert IN OUT.jpg, because COLMAP does not read them";
  return fmt::format("{}: left out {} picture{} of types that cannot be used without poses: {}; {}",
                     printable(folder.string()), others.size(), others.size() == 1 ? "" : "s", some_names(others),
                     remedy);
}

Unposed unposed_in(const fs::path& folder, std::vector<std::string> names) {
  Unposed result{{}, folder, std::move(names), masks_beside(folder), {}};
  if (std::string note = skipped_note(folder); !note.empty()) result.notes.push_back(std::move(note));
  return result;
}

}  // namespace

std::vector<std::string> photographs_in(const fs::path& folder) {
  const std::vector<std::string> files = files_in(folder);
  std::set<std::string> stems;
  for (const std::string& name : files) stems.insert(name_key(picture_stem(name)));
  std::vector<std::string> names;
  for (const std::string& name : files) {
    if (!is_for_colmap(name)) continue;
    const MaskName mask = mask_name(name);
    const bool is_mask = mask.marked && std::any_of(mask.photographs.begin() + 1, mask.photographs.end(),
                                                    [&](const std::string& other) { return stems.contains(other); });
    if (!is_mask) names.push_back(name);
  }
  return names;
}

std::vector<std::string> unread_pictures_in(const fs::path& path) {
  for (const fs::path& folder : places_in(path)) {
    std::vector<std::string> names = files_in(folder);
    std::erase_if(names, [](const std::string& name) { return !is_picture(name) || is_for_colmap(name); });
    if (!names.empty()) return names;
  }
  return {};
}

bool is_video(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* known : {".mp4", ".m4v", ".mov", ".mkv", ".avi", ".webm"})
    if (extension == known) return is_file(path);
  return false;
}

std::optional<Unposed> find_unposed(const fs::path& path) {
  if (has_poses(path)) return std::nullopt;
  if (is_video(path)) return Unposed{path, {}, {}, {}, {}};
  const std::vector<fs::path> places = places_in(path);
  for (const fs::path& folder : places)
    if (std::vector<std::string> names = photographs_in(folder); !names.empty())
      return unposed_in(folder, std::move(names));
  for (const fs::path& folder : places) {
    if (folder == path) continue;
    const std::vector<fs::path> inner = folders_with_photographs(folder);
    if (inner.size() == 1) return unposed_in(inner.front(), photographs_in(inner.front()));
    std::vector<std::string> names;
    for (const fs::path& part : inner)
      for (const std::string& name : photographs_in(part))
        names.push_back((part.lexically_relative(folder) / name).generic_string());
    std::sort(names.begin(), names.end());
    if (!names.empty()) return unposed_in(folder, std::move(names));
  }
  return std::nullopt;
}

}  // namespace trisoup::scene
