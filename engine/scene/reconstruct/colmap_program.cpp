#include "scene/reconstruct/colmap_program.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::scene {

namespace fs = std::filesystem;

std::optional<ColmapProgress> colmap_progress(std::string_view line) {
  const std::string text(line.substr(0, 200));
  int a = 0, b = 0, c = 0, d = 0;
  if (std::sscanf(text.c_str(), "Processed file [%d/%d]", &a, &b) == 2 && a > 0 && b >= a) return ColmapProgress{a, 0};
  if (std::sscanf(text.c_str(), "Matching block [%d/%d, %d/%d]", &a, &b, &c, &d) == 4 && a > 0 && b >= a &&
      b < 10'000 && c > 0 && d >= c && d < 10'000)
    return ColmapProgress{(a - 1) * d + c, b * d};
  // Of a list of pairs.
  char end = 0;
  if (std::sscanf(text.c_str(), "Matching block [%d/%d%c", &a, &b, &end) == 3 && end == ']' && a > 0 && b >= a)
    return ColmapProgress{a, b};
  if (std::sscanf(text.c_str(), "Matching image [%d/%d]", &a, &b) == 2 && a > 0 && b >= a) return ColmapProgress{a, b};
  // The number is that of the next photograph, which may still fail to register.
  if (std::sscanf(text.c_str(), "Registering image #%d (%d)", &a, &b) == 2 && b > 0) return ColmapProgress{b - 1, 0};
  return std::nullopt;
}

std::optional<double> colmap_exif_focal(std::string_view line) {
  const std::size_t at = line.find("Focal Length:");  // after the time in newer versions
  if (at == std::string_view::npos) return std::nullopt;
  const std::string text(line.substr(at, 100));
  double focal = 0;
  char end = 0;
  if (std::sscanf(text.c_str(), "Focal Length: %lfpx (Prior%c", &focal, &end) == 2 && end == ')' && focal > 0)
    return focal;
  return std::nullopt;
}

fs::path required_program(const char* name, const char* package, const char* purpose) {
  fs::path found = find_program(name);
  if (found.empty())
    throw Error(
        "{} is not installed; it {}; install it: sudo apt-get install {} (or tools/install_packages "
        "--for-photographs)",
        name, purpose, package);
  return found;
}

ChildResult ColmapProgram::run(const ColmapStage& stage, std::vector<std::string> arguments,
                               const std::atomic<bool>& stop,
                               const std::function<void(std::string_view)>& on_line) const {
  arguments.insert(arguments.begin(), path.string());
  progress(stage.name, stage.before, stage.total);
  int furthest = 0;
  ChildOptions child{.log = log, .append = true, .patience = 5, .on_line = [&](std::string_view line) {
                       if (on_line) on_line(line);
                       const auto at = colmap_progress(line);
                       // The mapper may start again, so lower counts are ignored.
                       if (!at || (at->total == 0 && at->done <= furthest)) return;
                       furthest = at->done;
                       progress(stage.name, stage.before + at->done, at->total > 0 ? at->total : stage.total);
                     }};
  return run_child(arguments, child, stop);
}

void ColmapProgram::check(const ChildResult& result, const std::string& command) const {
  if (result.status == 0) return;
  throw Error(
      "COLMAP's {} failed: {}; the log is {}; if memory or disk is full, free some or lower `feature_size`, then "
      "start again",
      command, reason_of(result), printable(log.string()));
}

std::string ColmapProgram::reason_of(const ChildResult& result) const {
  if (result.status > 128) return result.error;
  std::ifstream in(log);
  std::string reason;
  for (std::string line; std::getline(in, line);)
    for (const char* word : {"ERROR", "rror:", "Check failed", "Failed to", "terminate called", "what():"})
      if (line.find(word) != std::string::npos) reason = line;
  const std::string& chosen = reason.empty() ? result.error : reason;
  return printable(chosen.substr(std::min(chosen.find_first_not_of(" \t"), chosen.size())));
}

}  // namespace trisoup::scene
