// One line on a terminal; lines now and then where output goes to a file.
#pragma once

#include <cstdint>
#include <string>

#include "train/trainer.h"

namespace trisoup {

class ProgressBar {
 public:
  /// log_every: steps between lines when stderr is not a terminal. quiet: nothing at all.
  ProgressBar(std::uint64_t steps, std::uint64_t log_every, bool quiet);
  ~ProgressBar() { clear(); }

  void loading(int done, int total);
  void training(const train::Progress& progress);
  /// Takes the bar away, so that other lines can be printed.
  void clear();

 private:
  void draw(const std::string& line);
  std::uint64_t steps_, log_every_;
  bool quiet_, terminal_, drawn_ = false;
  double ms_ = 0;  // smoothed
};

}  // namespace trisoup
