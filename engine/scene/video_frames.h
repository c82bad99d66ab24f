// Still photographs from a video: ffmpeg takes it apart, and the sharpest frame of each stretch of time is kept.
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

/// Frames that are kept of a video, at most, and those that they are chosen from.
inline constexpr int kVideoFrames = 160, kVideoCandidates = 3 * kVideoFrames;

struct VideoOptions {
  std::filesystem::path ffmpeg, ffprobe, log;
  std::function<void(int done, int total)> taken,
      looked_at;  // frames taken out of the video; those whose sharpness is known
};

/// Variance of the Laplacian of the grey levels: blur of motion and of focus lowers it.
double sharpness(const Image& image);

/// Where the sharpest of each of `count` windows of about the same length is; all, where there are no more than that.
std::vector<std::size_t> sharpest_of_windows(std::span<const double> sharpness, std::size_t count);

/// Leaves up to kVideoFrames frames of the video in `folder`, which is new, as frame_0001.jpg and so on in the order of
/// time. Returns how many they were chosen from. Throws Error; where `stop` is set it returns early, with anything in
/// the folder.
std::size_t extract_frames(const std::filesystem::path& video, const std::filesystem::path& folder,
                           const VideoOptions& options, const std::atomic<bool>& stop);

}  // namespace trisoup::scene
