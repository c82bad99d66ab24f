#include "scene/photograph_files.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"

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

// Returns `path` without its first folder if that is images/, else nullopt.
std::optional<fs::path> below_images(const fs::path& path) {
  if (path.empty() || *path.begin() != "images") return std::nullopt;
  return path.lexically_relative("images");
}

}  // namespace

bool is_photograph_name(const fs::path& name) {
  std::string extension = name.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return has_image_extension("x" + extension);
}

std::string normal_path(const std::string& path) {
  std::string turned = path;
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
    : root_(std::move(root)), outside_(outside) {
  for (const int factor : {2, 4, 8}) {
    const fs::path folder = "images_" + std::to_string(factor);
    if (downscale == factor && is_folder(root_ / folder)) prescaled_folder_ = folder;
  }
  has_masks_ = is_folder(root_ / "masks");
}

bool PhotographFiles::each_place(const std::string& path, const Take& take) const {
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
  if (!is_foreign(path)) return false;
  const std::string turned = normal_path(path);
  // Tries the endings of the path, longest first, without the drive and without ../.
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

std::optional<PhotographFile> PhotographFiles::find(const std::string& path) const {
  std::optional<PhotographFile> found;
  const auto take = [&](const fs::path& place, bool by_name) {
    found = at(place);
    if (found) found->by_name = by_name;
    return found.has_value();
  };
  if (!each_place(path, take) && is_foreign(path))
    found = only_one_named(fs::path(normal_path(path)).filename().string());
  return found;
}

std::string PhotographFiles::looked_for(const std::string& path) const {
  const std::string turned = normal_path(path);
  const std::string name = fs::path(turned).filename().string();
  std::string text = printable((root_ / path).lexically_normal().string());
  if (!prescaled_folder_.empty())
    text += fmt::format(" and {}", printable((root_ / prescaled_folder_ / name).string()));
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
  each_place(path, [&](const fs::path& place, bool) {
    if (is_file(root_ / place)) found = root_ / place;
    return found.has_value();
  });
  return found;
}

std::optional<PhotographFile> PhotographFiles::only_one_named(const std::string& name) const {
  if (!by_name_) {
    by_name_.emplace();
    std::error_code ignored;
    for (fs::recursive_directory_iterator entry(root_, fs::directory_options::skip_permission_denied, ignored), end;
         entry != end; entry.increment(ignored)) {
      const fs::path relative = entry->path().lexically_relative(root_);
      const std::string folder = relative.begin()->string();
      if (folder == "masks" || folder == "images_2" || folder == "images_4" || folder == "images_8") {
        entry.disable_recursion_pending();
        continue;
      }
      if (!is_photograph_name(relative)) continue;
      by_name_->emplace(relative.filename().string(), relative);
      by_name_->emplace(relative.stem().string(), relative);
    }
  }
  const auto [first, last] = by_name_->equal_range(name);
  if (std::distance(first, last) != 1) return std::nullopt;
  auto found = at(first->second);
  if (found) found->by_name = true;
  return found;
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

  if (const auto rest = below_images(relative); rest && !prescaled_folder_.empty()) {
    // Prescaled copies may have another file type, and the original may be missing.
    const fs::path same = root_ / prescaled_folder_ / *rest;
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

fs::path PhotographFiles::find_mask(const std::string& name) const {
  if (!has_masks_) return {};
  const fs::path path = name, rest = below_images(path).value_or(path);
  if (rest.is_absolute()) return {};
  const fs::path same = root_ / "masks" / rest, png = with_suffix(same.parent_path() / same.stem(), ".png");
  for (const fs::path& candidate : {same, with_suffix(same, ".png"), png})
    if (is_file(candidate)) return candidate;
  return {};
}

}  // namespace trisoup::scene
