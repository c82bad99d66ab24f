// One line on a terminal; lines now and then where output goes to a file.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "run/part_times.h"
#include "run/trainer.h"

namespace trisoup {

/// A line of at most `columns` characters: `name`, a bar of `share` (0 to 1), then `parts`. Each part is a text and how
/// much it matters; where there is no room, those that matter least go first, then the bar, and the end of the name
/// last of all.
struct LinePart {
  std::string text;
  int weight = 0;
};
std::string fitted_line(const std::string& name, double share, std::vector<LinePart> parts, std::size_t columns);

class ProgressBar {
 public:
  /// log_every: steps between lines when stderr is not a terminal. quiet: nothing at all.
  ProgressBar(std::uint64_t steps, std::uint64_t log_every, bool quiet);
  ~ProgressBar() { clear(); }

  /// How far a stage of the work before training is: one line that moves, or one line for each stage.
  void stage(const std::string& name, int done, int total);
  void loading(int done, int total);
  void training(const train::Progress& progress);
  /// Names what the training is at, on a terminal: nothing else moves until its next report.
  void part(train::Part part);
  /// There are to be more steps than at first.
  void go_on_to(std::uint64_t steps) { steps_ = steps; }
  /// Takes the bar away, so that other lines can be printed.
  void clear();

 private:
  void draw(const std::string& name, double share, std::vector<LinePart> parts);
  std::uint64_t steps_, log_every_;
  bool quiet_, terminal_, drawn_ = false;
  double ms_ = 0;  // smoothed
  double pace_ = 1;
  std::string part_;             // that is named now
  double share_ = 0;             // of the last report of training
  std::vector<LinePart> parts_;  // and what it said
  std::string stage_;
  std::chrono::steady_clock::time_point stage_begin_;
};

}  // namespace trisoup
