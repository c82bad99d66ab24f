// Finds poses for photographs without poses by running COLMAP.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "scene/datasets/unposed.h"

namespace trisoup::scene {

/// Smallest number and smallest share of photographs that must have a pose.
inline constexpr std::size_t kLeastRegistered = 3;
inline constexpr double kLeastShare = 1.0 / 3;

/// Up to this number of photographs, each is matched with all others. In larger sets and among frames of a video, each
/// is matched with its neighbours in name order, and some with each other (see loop_pairs()).
inline constexpr std::size_t kMostExhaustive = 200;

struct ReconstructOptions {
  int feature_size = 1600;  // longer side to which photographs are reduced for feature detection, pixels
  bool resume = false;      // throw Error instead of replacing results for other photographs
  std::function<void(const std::string& stage, int done, int total)> progress;  // called from one thread at a time
  std::function<void(const std::string& line)> warn;                            // one call per warning, one line each
};

struct Reconstruction {
  std::filesystem::path dataset;                // a folder for load()
  std::size_t photographs = 0, registered = 0;  // number of readable photographs, and of those with a pose
  /// Number of video frames from which the photographs were selected; 0: not a video, or selected earlier.
  std::size_t candidates = 0;
  bool reused = false;  // existing results were used
  std::string cameras;  // one line: camera model, focal length, error, and which mapping was chosen
};

/// Thrown if `stop` is set. The same call later continues after the last completed stage.
struct ReconstructionStopped {};

/// Finds poses and writes to `folder`: images (a link to the photographs, or frames of the video), database.db,
/// sparse/0, and log.txt (the output of COLMAP and ffmpeg). Files get these names only when they are complete. Existing
/// results for the same photographs (by name, size and modification time) are reused. Throws Error if a program is
/// missing or fails, or if too few photographs are registered.
Reconstruction reconstruct(const Unposed& unposed, const std::filesystem::path& folder,
                           const ReconstructOptions& options, const std::atomic<bool>& stop);

}  // namespace trisoup::scene
