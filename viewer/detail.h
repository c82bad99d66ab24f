// How many pixels a rendering has where a CPU draws: fewer than the window while the camera moves, more when it rests.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

namespace trisoup::viewer {

/// What a rendering is for.
enum class Detail { all, rest, motion };

/// Pixels of a rendering, at most.
inline constexpr double kMotionPixels = 80'000;         // while the camera moves
inline constexpr double kSharedMotionPixels = 30'000;   // the same beside a training that wants the CPU
inline constexpr double kSharedRestPixels = 1'100'000;  // beside it, of a camera that rests
/// What a rendering of all pixels may take before one of fewer stands in for it in motion.
inline constexpr double kSmoothMs = 40;

/// The side of a square of pixels in the window, one to eight, that one pixel of the rendering stands for.
inline std::uint32_t pixel_side(std::uint32_t width, std::uint32_t height, double pixels) {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(std::sqrt(double(width) * height / pixels)), 1.0, 8.0));
}

/// When a camera rests, and when it is drawn with more pixels beside a training: once in kRest, however often it stops,
/// and for no more than a fifth of the time.
class Rest {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kStill{200}, kRest{1000};
  void moved(Clock::time_point now) { moved_ = now; }
  bool moving(Clock::time_point now) const { return now - moved_ < kStill; }
  bool due(Clock::time_point now) const { return !moving(now) && now >= due_; }
  /// took: drawing it, until now.
  void take(Clock::time_point now, Clock::duration took) { due_ = now + std::max<Clock::duration>(kRest, 4 * took); }
  /// When the next one is due, if the camera does not move.
  Clock::time_point next() const { return due_; }

 private:
  Clock::time_point moved_{}, due_{};
};

}  // namespace trisoup::viewer
