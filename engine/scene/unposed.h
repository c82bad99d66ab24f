// Photographs and videos that nothing says the poses of.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace trisoup::scene {

struct Unposed {
  std::filesystem::path video;     // empty: there are photographs
  std::filesystem::path folder;    // of the photographs
  std::vector<std::string> names;  // of their files, sorted
};

/// What `path` holds where it holds no poses: the photographs of path/images, else those of the folder itself, without
/// what lies in further folders; or the video that it is. Nothing where there are poses (has_poses), or neither.
std::optional<Unposed> find_unposed(const std::filesystem::path& path);

/// The names of all photographs in a folder, sorted; hidden files are none.
std::vector<std::string> photographs_in(const std::filesystem::path& folder);

/// Whether it is a file that is named as videos are: mp4, m4v, mov, mkv, avi, webm.
bool is_video(const std::filesystem::path& path);

}  // namespace trisoup::scene
