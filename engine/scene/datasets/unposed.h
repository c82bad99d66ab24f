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
  std::vector<std::string> names;  // paths of the photographs in `folder`, sorted
  std::filesystem::path masks;     // folder of their masks; empty: none
  std::vector<std::string> notes;  // one line each: what is left out
};

/// Finds photographs or a video without poses. If `path` is a folder, returns the photographs in path/images, else
/// those in the folder itself, else those in another folder of photographs such as input/; if these are in subfolders,
/// all of them, or the only subfolder. If it is a video, returns the video. Returns nullopt if there are poses
/// (has_poses), or neither photographs nor a video.
std::optional<Unposed> find_unposed(const std::filesystem::path& path);

/// Returns the names of all photographs in a folder that COLMAP reads, sorted, without hidden files and masks.
std::vector<std::string> photographs_in(const std::filesystem::path& folder);

/// Returns the names of pictures in the folder that find_unposed() would search and that this program or COLMAP does
/// not read, such as HEIC, sorted.
std::vector<std::string> unread_pictures_in(const std::filesystem::path& path);

/// Returns whether `path` is a file with an extension of videos: mp4, m4v, mov, mkv, avi, webm.
bool is_video(const std::filesystem::path& path);

}  // namespace trisoup::scene
