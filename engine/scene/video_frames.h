// Extracts photographs from a video with ffmpeg, and keeps the sharpest frame of each time window.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "image/image.h"

namespace trisoup::scene {

/// Largest number of frames that are kept of a video, and number of frames from which they are selected.
inline constexpr int kVideoFrames = 160, kVideoCandidates = 3 * kVideoFrames;

struct VideoOptions {
  std::filesystem::path ffmpeg, ffprobe, log;
  /// Progress of extracting frames and of measuring their sharpness.
  std::function<void(int done, int total)> taken, looked_at;
};

/// Returns the variance of the Laplacian of the grey levels. Motion blur and defocus lower it.
double sharpness(const Image& image);

/// Splits the frames into `count` windows of about equal length, and returns the index of the sharpest frame of each.
/// Returns all indices if there are at most `count` frames.
std::vector<std::size_t> sharpest_of_windows(std::span<const double> sharpness, std::size_t count);

/// Writes up to kVideoFrames frames of the video to the empty `folder`: frame_0001.jpg and so on, ordered by time.
/// Returns the number of frames from which they were selected. Throws Error if ffmpeg or ffprobe fails. If `stop` is
/// set, returns early with arbitrary files in the folder.
std::size_t extract_frames(const std::filesystem::path& video, const std::filesystem::path& folder,
                           const VideoOptions& options, const std::atomic<bool>& stop);

}  // namespace trisoup::scene
