#include "scene/photograph_files.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "read_file.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 6> extensions{".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"};

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

fs::path with_suffix(fs::path path, const char* suffix) { return path += suffix; }

bool has_image_extension(const fs::path& path) {
  const std::string extension = path.extension().string();
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

// `path` below its first folder, if that is images/.
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

PhotographFiles::PhotographFiles(fs::path root, double downscale) : root_(std::move(root)) {
  for (const int factor : {2, 4, 8}) {
    const fs::path folder = "images_" + std::to_string(factor);
    if (downscale == factor && is_folder(root_ / folder)) prescaled_folder_ = folder;
  }
  has_masks_ = is_folder(root_ / "masks");
}

std::optional<PhotographFile> PhotographFiles::find(const std::string& path) const {
  fs::path relative = fs::path(path).lexically_normal();
  if (relative.is_absolute())
    if (const fs::path inside = relative.lexically_relative(fs::absolute(root_).lexically_normal());
        !inside.empty() && *inside.begin() != "..")
      relative = inside;

  PhotographFile found{relative.generic_string(), root_ / relative, false};
  bool exists = is_file(found.file);
  // Blender writes no extension, and a dot in the name need not start one ("r_0.5"), so each is tried behind it.
  if (!exists && !has_image_extension(relative))
    for (const char* extension : extensions)
      if (!exists && is_file(with_suffix(root_ / relative, extension))) {
        found.name += extension;
        found.file += extension;
        exists = true;
      }

  if (const auto rest = below_images(relative); rest && !prescaled_folder_.empty()) {
    // Prescaled copies may be of another type, and may be all that was downloaded.
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
