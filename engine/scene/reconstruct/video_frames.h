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

/// What ffprobe says about a video.
struct VideoFacts {
  double seconds = 0;                       // 0: unknown
  std::string matrix, transfer, primaries;  // ffmpeg's names, such as bt709; empty or "unknown": not in the file

  /// Takes a line "key=value" of ffprobe. Ignores other lines and keys.
  void take(std::string_view line);

  /// PQ or HLG.
  bool high_dynamic_range() const { return transfer == "smpte2084" || transfer == "arib-std-b67"; }
  /// BT.2020 or P3 with standard dynamic range.
  bool wide_gamut() const {
    return !high_dynamic_range() && (primaries == "bt2020" || primaries == "smpte431" || primaries == "smpte432");
  }
  /// Returns filters of ffmpeg, each after a comma, that make frames which are right as JPEG in sRGB: standard dynamic
  /// range, primaries of BT.709, matrix of BT.601. Without them, JPEG frames keep the video's values, which mean other
  /// colours there. Empty if the video has these already, or says nothing about its colours.
  std::string colour_filters() const;
};

/// Returns the variance of the Laplacian of the grey levels. Motion blur and defocus lower it.
double sharpness(const Image& image);

/// Splits the frames into `count` windows of about equal length, and returns the index of the sharpest frame of each.
/// Returns all indices if there are at most `count` frames.
std::vector<std::size_t> sharpest_of_windows(std::span<const double> sharpness, std::size_t count);

/// Writes up to kVideoFrames frames of the video to the empty `folder`: frame_0001.jpg and so on, ordered by time.
/// Returns the number of frames from which they were selected. Colours are
/// converted to sRGB. Throws Error if ffmpeg or ffprobe fails, or lacks the filter that a video of high dynamic range
/// needs. If `stop` is
/// set, returns early with arbitrary files in the folder.
std::size_t extract_frames(const std::filesystem::path& video, const std::filesystem::path& folder,
                           const VideoOptions& options, const std::atomic<bool>& stop);

}  // namespace trisoup::scene
