#include "scene/files/photograph_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <tuple>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/files/dataset_places.h"
#include "scene/files/mask_name.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 12> extensions{".png",  ".jpg",  ".jpeg", ".PNG",  ".JPG", ".JPEG",
                                                 ".webp", ".WEBP", ".tif",  ".tiff", ".TIF", ".TIFF"};

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

fs::path with_suffix(fs::path path, const char* suffix) { return path += suffix; }

bool has_image_extension(const fs::path& path) {
  const std::string extension = path.extension().string();
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

bool leaves(const fs::path& relative) { return !relative.empty() && *relative.begin() == ".."; }

/// Returns whether a path may come from another machine or folder. Its file may still exist in the dataset.
bool is_foreign(const std::string& path) {
  const std::string turned = normal_path(path);
  return is_absolute_path(path) || leaves(turned) || turned != fs::path(path).lexically_normal().generic_string();
}

// Returns the place of a photograph's prescaled copy, or an empty path if it is not in a folder images/ with a folder
// of copies beside it.
fs::path prescaled_copy(const fs::path& root, const fs::path& relative, const std::string& folder) {
  fs::path before;
  for (auto part = relative.begin(); part != relative.end(); ++part) {
    if (*part == "images") {
      if (!is_folder(root / before / folder)) return {};
      fs::path copy = before / folder;
      for (++part; part != relative.end(); ++part) copy /= *part;
      return copy;
    }
    before /= *part;
  }
  return {};
}

// Returns the keys of the folders of a path, without drive and ../.
std::vector<std::string> listed_folders(const fs::path& path) {
  std::vector<std::string> keys;
  for (const std::string& key : path_keys(path.parent_path()))
    if (key != ".." && !key.ends_with(':')) keys.push_back(key);
  return keys;
}

// Returns whether two folders are those of different parts of a split, as train/ and test/, which have the same names.
bool are_other_parts(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  constexpr std::array<std::array<std::string_view, 4>, 3> parts{{{"train", "training", "train_images", "images_train"},
                                                                  {"test", "testing", "eval", "images_test"},
                                                                  {"val", "valid", "validation", "images_val"}}};
  const auto part_of = [&](const std::vector<std::string>& folders) {
    for (std::size_t part = 0; part < parts.size(); ++part)
      for (const std::string& folder : folders)
        if (std::find(parts[part].begin(), parts[part].end(), folder) != parts[part].end()) return int(part);
    return -1;
  };
  const int one = part_of(a), other = part_of(b);
  return one >= 0 && other >= 0 && one != other;
}

// Returns the order of preference of a folder to which a path may be relative.
std::size_t rank_of_place(const TreePicture& picture, std::size_t agreeing) {
  const std::size_t rest = picture.folders.size() - agreeing;
  if (picture.reduced_by > 0) return 5000 + static_cast<std::size_t>(picture.reduced_by);  // the largest copies
  if (rest == 0) return 0;
  const auto names = picture_folder_names();
  const auto known = std::find(names.begin(), names.end(), picture.folders[rest - 1]);
  // images before dense/images, and both before other folders.
  return known == names.end()
             ? 1000
             : static_cast<std::size_t>(known - names.begin()) + 1 + 100 * std::min<std::size_t>(rest - 1, 8);
}

}  // namespace

std::string normal_path(const std::string& path) {
  std::string turned = without_url(path);
  std::replace(turned.begin(), turned.end(), '\\', '/');
  return fs::path(turned).lexically_normal().generic_string();
}

bool is_absolute_path(const std::string& path) {
  const std::string turned = normal_path(path);
  const bool drive =
      turned.size() > 2 && std::isalpha(static_cast<unsigned char>(turned[0])) && turned[1] == ':' && turned[2] == '/';
  return drive || turned.starts_with('/');
}

PhotographFiles::PhotographFiles(fs::path root, double downscale, bool outside)
    : root_(std::move(root)), downscale_(downscale), outside_(outside) {
  for (const int factor : {2, 4, 8})
    if (downscale == factor) prescaled_ = "images_" + std::to_string(factor);
}

bool PhotographFiles::as_it_stands(const std::string& path, const Take& take) const {
  fs::path relative = fs::path(path).lexically_normal();
  if (relative.is_absolute())
    if (const fs::path inside = relative.lexically_relative(fs::absolute(root_).lexically_normal());
        !inside.empty() && !leaves(inside))
      relative = inside;
  const bool beyond = relative.is_absolute() || leaves(relative);
  if ((!beyond || outside_) && take(relative, false)) return true;
  if (beyond && !outside_ && is_file(root_ / relative)) {
    std::error_code ignored;
    const fs::path inside =
        fs::weakly_canonical(root_ / relative, ignored).lexically_relative(fs::weakly_canonical(root_, ignored));
    if (inside.empty() || leaves(inside))
      throw Error("{}: lies outside the dataset {}; copy it there, or allow it with `outside`", printable(path),
                  printable(root_.string()));
    return take(inside, false);
  }
  return false;
}

bool PhotographFiles::each_ending(const std::string& path, const Take& take) const {
  const std::string turned = normal_path(path);
  std::vector<fs::path> parts;
  for (const fs::path& part : fs::path(turned))
    if (part != "/" && part != ".." && !part.string().ends_with(':')) parts.push_back(part);
  for (std::size_t first = 0; first < parts.size(); ++first) {
    fs::path tail;
    for (std::size_t i = first; i < parts.size(); ++i) tail /= parts[i];
    for (const fs::path& place : {tail, "images" / tail})
      if (take(place, place != turned)) return true;
    // If the folder of this ending exists but the file does not, the photograph is missing. Shorter endings could match
    // another file.
    if (tail.has_parent_path() &&
        (is_folder(root_ / tail.parent_path()) || is_folder(root_ / "images" / tail.parent_path())))
      return false;
  }
  return false;
}

const PictureTree& PhotographFiles::tree() const {
  if (!tree_) tree_ = std::make_unique<PictureTree>(root_);
  return *tree_;
}

const TreePicture* PhotographFiles::by_name(const std::string& path, bool masks,
                                            std::vector<std::string>* candidates) const {
  const fs::path listed(normal_path(path));
  const std::string file = listed.filename().string(), name = name_key(file);
  const std::vector<std::string> folders = listed_folders(listed);
  struct Candidate {
    const TreePicture* picture;
    std::tuple<std::size_t, bool, std::size_t> order;  // smallest first
  };
  std::vector<Candidate> found;
  for (const TreePicture* picture : tree().stemmed(name_key(picture_stem(file)))) {
    const std::size_t agreeing = common_end(folders, picture->folders);
    const bool whole = !folders.empty() && agreeing == folders.size();
    const bool mask = (picture->name == name && mask_name(name).marked) ||
                      std::any_of(picture->folders.begin(), picture->folders.end(), [](const std::string& folder) {
                        return mask_folder_kind(folder) != MaskFolderKind::none;
                      });
    if (!whole && (masks ? !mask : picture->aside)) continue;
    if (are_other_parts(folders, picture->folders)) continue;
    found.push_back({picture, {folders.size() - agreeing, picture->name != name, rank_of_place(*picture, agreeing)}});
  }
  if (found.empty()) return nullptr;
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.order < b.order; });
  // If a folder agrees with a longer ending of the path, the photograph is missing there.
  for (std::size_t first = 0; first < std::get<0>(found.front().order); ++first)
    if (tree().has_folder(folders, first, masks)) return nullptr;
  if (found.size() == 1 || found[0].order < found[1].order) return found.front().picture;
  for (const Candidate& candidate : found)
    if (candidates && candidate.order == found.front().order)
      candidates->push_back(candidate.picture->relative.generic_string());
  return nullptr;
}

std::optional<PhotographFile> PhotographFiles::find(const std::string& path,
                                                    std::vector<std::string>* candidates) const {
  std::optional<PhotographFile> found;
  const auto take = [&](const fs::path& place, bool by_name) {
    found = at(place);
    if (found) found->by_name = by_name;
    return found.has_value();
  };
  const std::string local = without_url(path);
  if (as_it_stands(local, take)) return found;
  if (const std::string turned = normal_path(path); turned != local && !is_absolute_path(turned))
    if (as_it_stands(turned, take)) return found;
  for (const std::string& spelling : {local, without_escapes(local)}) {
    if (const TreePicture* picture = by_name(spelling, false, candidates)) {
      found = at(picture->relative);
      if (!found) return std::nullopt;
      found->by_name = true;
      found->by_name_alone = common_end(listed_folders(normal_path(spelling)), picture->folders) == 0;
      return found;
    }
    if ((candidates && !candidates->empty()) || local.find('%') == std::string::npos) break;
  }
  // A file that is not named like a picture.
  if (is_foreign(local) && (!candidates || candidates->empty()))
    each_ending(local, [&](const fs::path& place, bool by_name) {
      return !is_readable_picture_name(place) && take(place, by_name);
    });
  return found;
}

std::string PhotographFiles::looked_for(const std::string& path) const {
  const std::string turned = normal_path(path);
  const std::string name = fs::path(turned).filename().string();
  std::string text = printable((root_ / without_url(path)).lexically_normal().string());
  if (!prescaled_.empty() && is_folder(root_ / prescaled_))
    text += fmt::format(" and {}", printable((root_ / prescaled_ / name).string()));
  if (!has_image_extension(turned)) text += ", also with .png, .jpg, .jpeg, .webp, .tif and .tiff";
  if (is_foreign(path))
    text += fmt::format(
        ", for every ending of that path down to {} in {} and its images folder, and for a single photograph with that "
        "name below",
        printable(name), printable(root_.string()));
  return text;
}

std::optional<fs::path> PhotographFiles::find_file(const std::string& path) const {
  std::optional<fs::path> found;
  const auto take = [&](const fs::path& place, bool) {
    if (is_file(root_ / place)) found = root_ / place;
    return found.has_value();
  };
  const std::string local = without_url(path);
  if (as_it_stands(local, take) || (is_foreign(local) && each_ending(local, take))) return found;
  return std::nullopt;
}

std::optional<fs::path> PhotographFiles::find_listed_mask(const std::string& path) const {
  // Shorter endings of a path would lead to the photograph, which usually has the same name.
  if (!is_readable_picture_name(path)) return find_file(path);
  std::optional<fs::path> found;
  const std::string local = without_url(path);
  const auto take = [&](const fs::path& place, bool) {
    if (is_file(root_ / place)) found = root_ / place;
    return found.has_value();
  };
  if (as_it_stands(local, take) || as_it_stands(normal_path(local), take)) return found;
  if (const TreePicture* picture = by_name(local, true, nullptr)) return root_ / picture->relative;
  return std::nullopt;
}

bool PhotographFiles::are_parallel(const fs::path& a, const fs::path& b) const {
  const std::set<std::string> one = tree().stems_in(path_keys(a)), other = tree().stems_in(path_keys(b));
  return std::any_of(one.begin(), one.end(), [&](const std::string& stem) { return other.contains(stem); });
}

std::optional<PhotographFile> PhotographFiles::at(const fs::path& relative) const {
  PhotographFile found{relative.generic_string(), root_ / relative, false, false};
  bool exists = is_file(found.file);
  // Blender writes paths without extension, and a dot in a name need not start one ("r_0.5"), so all extensions are
  // appended in turn.
  if (!exists && !has_image_extension(relative))
    for (const char* extension : extensions)
      if (!exists && is_file(with_suffix(root_ / relative, extension))) {
        found.name += extension;
        found.file += extension;
        exists = true;
      }

  // Prescaled copies may have another file type, and the original may be missing.
  const fs::path copy = prescaled_.empty() ? fs::path() : prescaled_copy(root_, relative, prescaled_);
  if (!copy.empty()) {
    const fs::path same = root_ / copy;
    std::array<fs::path, 1 + extensions.size()> candidates{same};
    const bool replace = has_image_extension(same);
    for (std::size_t i = 0; i < extensions.size(); ++i)
      candidates[i + 1] = with_suffix(replace ? same.parent_path() / same.stem() : same, extensions[i]);
    for (const fs::path& candidate : candidates)
      if (is_file(candidate)) {
        if (!exists && !replace) found.name += candidate.extension().string();
        found.file = candidate;
        found.prescaled = true;
        return found;
      }
  }
  if (!exists) return std::nullopt;
  return found;
}

}  // namespace trisoup::scene
