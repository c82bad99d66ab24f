#include "scene/unposed.h"

#include <algorithm>
#include <cctype>

#include "base/read_file.h"
#include "scene/dataset.h"
#include "scene/photograph_files.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

std::vector<std::string> photographs_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    // Some systems create a hidden file with the same extension for each photograph.
    if (!name.starts_with('.') && is_photograph_name(name) && is_file(entry.path())) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
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
  if (is_video(path)) return Unposed{path, {}, {}};
  for (const fs::path& folder : {path / "images", path})
    if (std::vector<std::string> names = photographs_in(folder); !names.empty())
      return Unposed{{}, folder, std::move(names)};
  return std::nullopt;
}

}  // namespace trisoup::scene
