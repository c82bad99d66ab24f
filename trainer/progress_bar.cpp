#include "progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

namespace trisoup {
namespace {

std::string duration(double seconds) {
  const auto s = static_cast<long long>(std::llround(seconds));
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

std::string bar(double share) {
  constexpr int kWidth = 24;
  const int full = static_cast<int>(share * kWidth);
  return fmt::format("[{}{}]", std::string(full, '#'), std::string(kWidth - full, '.'));
}

}  // namespace

ProgressBar::ProgressBar(std::uint64_t steps, std::uint64_t log_every, bool quiet)
    : steps_(steps), log_every_(log_every), quiet_(quiet), terminal_(isatty(STDERR_FILENO)) {}

void ProgressBar::loading(int done, int total) {
  if (quiet_ || !terminal_ || total == 0) return;
  draw(fmt::format("images {} {}/{}", bar(double(done) / total), done, total));
}

void ProgressBar::stage(const std::string& name, int done, int total) {
  if (quiet_ || total == 0) return;
  const auto now = std::chrono::steady_clock::now();
  if (name != stage_) {
    stage_ = name, stage_begin_ = now;
    if (!terminal_) std::fprintf(stderr, "%s\n", name.c_str());
  }
  if (!terminal_) return;
  const double passed = std::chrono::duration<double>(now - stage_begin_).count();
  const std::string left = done > 0 && passed > 5 ? fmt::format("  about {} left", duration(passed * (total - done) / done)) : "";
  draw(fmt::format("{} {} {}/{}{}", name, bar(std::min(1.0, double(done) / total)), done, total, left));
}

void ProgressBar::training(const train::Progress& p) {
  if (quiet_) return;
  ms_ = ms_ == 0 ? p.ms_per_step : 0.8 * ms_ + 0.2 * p.ms_per_step;
  const double left = 1e-3 * ms_ * static_cast<double>(steps_ - p.step);
  const std::string line =
      fmt::format("{}/{}  loss {:.4f}  PSNR {:.2f}  {} triangles  {:.1f} ms/step  {} left", p.step, steps_, p.loss, p.psnr,
                  p.triangles, ms_, duration(left));
  if (terminal_) draw(bar(double(p.step) / double(steps_)) + " " + line);
  else if (log_every_ > 0 && (p.step % log_every_ == 0 || p.step == steps_)) std::fprintf(stderr, "%s\n", line.c_str());
}

void ProgressBar::draw(const std::string& line) {
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace trisoup
