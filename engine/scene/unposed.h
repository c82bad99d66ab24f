// Photographs and videos without poses.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace trisoup::scene {

struct Unposed {
  std::filesystem::path video;     // empty: use the photographs
  std::filesystem::path folder;    // folder of the photographs
  std::vector<std::string> names;  // file names of the photographs, sorted
};

/// Finds photographs or a video without poses. If `path` is a folder, returns the photographs in path/images, else
/// those in the folder itself, without subfolders. If it is a video, returns the video. Returns nullopt if there are
/// poses (has_poses), or neither photographs nor a video.
std::optional<Unposed> find_unposed(const std::filesystem::path& path);

/// Returns the names of all photographs in a folder, sorted, without hidden files.
std::vector<std::string> photographs_in(const std::filesystem::path& folder);

/// Returns whether `path` is a file with an extension of videos: mp4, m4v, mov, mkv, avi, webm.
bool is_video(const std::filesystem::path& path);

}  // namespace trisoup::scene
