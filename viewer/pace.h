// How often pictures come where they must not come too often.
#pragma once

#include <algorithm>
#include <chrono>

namespace trisoup::viewer {

/// One picture in every interval, on average. What comes a little late, as a thread does that gives way, does not put
/// off all that follows; what is later than an interval is not made up for; and pictures that nobody waited for leave
/// no debt.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Pace(Clock::duration interval) : interval_(interval) {}
  /// Until when to wait for the next picture; at most an interval after the last.
  Clock::time_point due() const { return due_; }
  void take(Clock::time_point now) { due_ = (now - due_ < interval_ ? std::min(due_, now) : now) + interval_; }

 private:
  Clock::duration interval_;
  Clock::time_point due_{};
};

}  // namespace trisoup::viewer
