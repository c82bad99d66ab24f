// Poses for photographs that have none: COLMAP, a program of its own, finds them.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/unposed.h"

namespace trisoup::scene {

/// Fewer photographs with poses than these, or than this share of all, are no dataset.
inline constexpr std::size_t kLeastRegistered = 3;
inline constexpr double kLeastShare = 1.0 / 3;

/// Every photograph is compared with every other up to so many; beyond, and in videos, with its neighbours in name
/// order.
inline constexpr std::size_t kMostExhaustive = 200;

struct ReconstructOptions {
  int feature_size = 1600;  // features are looked for in photographs shrunk to so many pixels along the longer side
  bool resume = false;      // what was found from other photographs is an error, and not replaced
  std::function<void(const std::string& stage, int done, int total)> progress;  // called from one thread at a time
  std::function<void(const std::string& line)> warn;                            // one call per warning, one line each
};

struct Reconstruction {
  std::filesystem::path dataset;                // a folder that load() reads
  std::size_t photographs = 0, registered = 0;  // those that could be read, and those of them that have a pose
  std::size_t candidates =
      0;                // frames of the video that the photographs were chosen from; 0: of no video, or chosen earlier
  bool reused = false;  // it was there already
};

/// Thrown where `stop` was set; the same call goes on after the last stage that was complete.
struct ReconstructionStopped {};

/// Finds poses and leaves in `folder` images (a link to the photographs, or frames of the video), database.db, sparse/0
/// and log.txt (all that COLMAP and ffmpeg print). Each has its name only when it is whole. What is there of the same
/// photographs (names, sizes, times of change) is not made again. Throws Error: a program is missing or fails, or too
/// few photographs are registered.
Reconstruction reconstruct(const Unposed& unposed, const std::filesystem::path& folder,
                           const ReconstructOptions& options, const std::atomic<bool>& stop);

struct ColmapProgress {
  int done = 0, total = 0;  // total 0: the number of photographs
};
/// What a line of COLMAP's output says about how far it is.
std::optional<ColmapProgress> colmap_progress(std::string_view line);

}  // namespace trisoup::scene
