// Progress on stderr: one line that is updated on a terminal, otherwise a new line every `log_every` steps.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "run/part_times.h"
#include "run/trainer.h"

namespace trisoup {

struct LinePart {
  std::string text;
  int weight = 0;  // parts with the smallest weight are dropped first
};
/// A line of at most `columns` characters: `name`, a bar that is full to `share` (0 to 1), then `parts`. If the line is
/// too long, drops parts, then the bar, then cuts the end.
std::string fitted_line(const std::string& name, double share, std::vector<LinePart> parts, std::size_t columns);

class ProgressBar {
 public:
  /// steps: last step of the training. log_every: steps between lines if stderr is not a terminal. quiet: prints
  /// nothing.
  ProgressBar(std::uint64_t steps, std::uint64_t log_every, bool quiet);
  ~ProgressBar() { clear(); }

  /// Shows the progress of a stage before training. Prints one line for each stage if stderr is not a terminal.
  void stage(const std::string& name, int done, int total);
  /// Shows how many images are loaded, on a terminal only.
  void loading(int done, int total);
  void training(const train::Progress& progress);
  /// Shows the current part of the training, on a terminal only. The rest of the line stays as it is until the next
  /// call of training().
  void part(train::Part part);
  /// Changes the last step.
  void go_on_to(std::uint64_t steps) { steps_ = steps; }
  /// Removes the bar so that other lines can be printed.
  void clear();

 private:
  void draw(const std::string& name, double share, std::vector<LinePart> parts);
  std::uint64_t steps_, log_every_;
  bool quiet_, terminal_, drawn_ = false;
  double ms_ = 0;  // per step, smoothed
  double pace_ = 1;
  std::string part_;             // shown now
  double share_ = 0;             // of the last call of training()
  std::vector<LinePart> parts_;  // of the last call of training()
  std::string stage_;
  std::chrono::steady_clock::time_point stage_begin_;
};

}  // namespace trisoup
