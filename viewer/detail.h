// Resolution of renderings on a CPU: lower than the window's while the camera moves.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

namespace trisoup::viewer {

/// all: full resolution. rest, motion: reduced resolution for a camera that rests or moves.
enum class Detail { all, rest, motion };

/// Largest number of pixels of a rendering.
inline constexpr double kMotionPixels = 80'000;         // while the camera moves
inline constexpr double kSharedMotionPixels = 30'000;   // the same while a training uses the CPU
inline constexpr double kSharedRestPixels = 1'100'000;  // camera at rest while a training uses the CPU
/// If a rendering at full resolution takes longer than this, a smaller one replaces it while the camera moves.
inline constexpr double kSmoothMs = 40;

/// Side in window pixels, 1 to 8, of the square that one pixel of the rendering covers.
inline std::uint32_t pixel_side(std::uint32_t width, std::uint32_t height, double pixels) {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(std::sqrt(double(width) * height / pixels)), 1.0, 8.0));
}

/// Tells when the camera rests and, while a training uses the CPU, when the next rendering of a resting camera is due:
/// at most one per kRest, and at most kShare of the CPU's time is spent on them.
class Rest {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kStill{200}, kRest{1000};
  static constexpr std::chrono::milliseconds kEarly{400};
  static constexpr double kShare = 0.02;
  /// early: number of renderings that are due kEarly after the last one, because a training changes most at its start.
  explicit Rest(int early = 0) : early_(early) {}
  void moved(Clock::time_point now) { moved_ = now; }
  bool moving(Clock::time_point now) const { return now - moved_ < kStill; }
  bool due(Clock::time_point now) const { return !moving(now) && now >= due_; }
  /// Call after a rendering at rest. took: CPU time divided by the number of cores.
  void take(Clock::time_point now, std::chrono::duration<double> took) {
    if (early_ > 0) {
      --early_;
      due_ = now + kEarly;
      return;
    }
    due_ = now + std::max<Clock::duration>(kRest, std::chrono::duration_cast<Clock::duration>(took / kShare));
  }
  /// Time when the next one is due if the camera does not move.
  Clock::time_point next() const { return due_; }

 private:
  Clock::time_point moved_{}, due_{};
  int early_;
};

}  // namespace trisoup::viewer
