// Running COLMAP.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/child_process.h"

namespace trisoup::scene {

struct ColmapProgress {
  int done = 0, total = 0;  // total 0: the number of photographs
};
/// Reads the progress from a line of COLMAP's output. Returns nullopt for other lines.
std::optional<ColmapProgress> colmap_progress(std::string_view line);

/// Reads the focal length in pixels, if a line of the feature extractor says that EXIF tells it.
std::optional<double> colmap_exif_focal(std::string_view line);

/// Returns the path of a program. Throws Error that states its purpose and how to install it if it is missing.
std::filesystem::path required_program(const char* name, const char* package, const char* purpose);

/// Stage of a search for poses whose progress is shown. before: part of it that earlier calls completed.
struct ColmapStage {
  std::string name;
  int before = 0, total = 0;
};

struct ColmapProgram {
  std::filesystem::path path, log;
  std::function<void(const std::string& stage, int done, int total)> progress;

  /// Runs a command and reports progress. on_line may be empty. Returns early if `stop` is set.
  ChildResult run(const ColmapStage& stage, std::vector<std::string> arguments, const std::atomic<bool>& stop,
                  const std::function<void(std::string_view)>& on_line = {}) const;

  /// Throws Error if a command failed.
  void check(const ChildResult& result, const std::string& command) const;
  /// Returns the reason of a failure: the last line of the log that mentions an error, else the last line.
  std::string reason_of(const ChildResult& result) const;
};

}  // namespace trisoup::scene
