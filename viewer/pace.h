// Limits the frame rate.
#pragma once

#include <algorithm>
#include <chrono>

namespace trisoup::viewer {

/// Allows one frame per interval on average. A frame less than an interval late does not delay the following ones. A
/// frame later than that is not made up for. After a frame that came early the next one is due an interval later.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Pace(Clock::duration interval) : interval_(interval) {}
  /// Earliest time of the next frame; at most an interval after the last.
  Clock::time_point due() const { return due_; }
  void take(Clock::time_point now) { due_ = (now - due_ < interval_ ? std::min(due_, now) : now) + interval_; }

 private:
  Clock::duration interval_;
  Clock::time_point due_{};
};

}  // namespace trisoup::viewer
