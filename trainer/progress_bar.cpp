#include "progress_bar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include <fmt/format.h>

namespace trisoup {
namespace {

std::string duration(double seconds) {
  const auto s = static_cast<long long>(std::llround(seconds));
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

constexpr std::size_t kWidestBar = 26, kNarrowestBar = 8;

std::string bar(double share, std::size_t width) {
  const std::size_t inner = width - 2,
                    full = std::min(inner, static_cast<std::size_t>(share * static_cast<double>(inner)));
  return fmt::format("[{}{}]", std::string(full, '#'), std::string(inner - full, '.'));
}

/// Columns available for a line. Asks the terminal each time because its width may change. The last column stays free:
/// some terminals start a new line after it.
std::size_t columns_now() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return (known ? size.ws_col : 80u) - 1u;
}

}  // namespace

std::string fitted_line(const std::string& name, double share, std::vector<LinePart> parts, std::size_t columns) {
  const auto length = [&] {
    std::size_t sum = name.empty() ? 0 : name.size() + 1;
    for (const LinePart& part : parts) sum += (&part == parts.data() ? 0 : 2) + part.text.size();
    return sum;
  };
  while (parts.size() > 1 && length() > columns)
    parts.erase(std::min_element(parts.begin(), parts.end(),
                                 [](const LinePart& a, const LinePart& b) { return a.weight < b.weight; }));
  std::string line = name;
  if (!name.empty()) line += ' ';
  if (const std::size_t taken = length() + 1; taken + kNarrowestBar <= columns)
    line += bar(std::clamp(share, 0.0, 1.0), std::min(columns - taken, kWidestBar)) + ' ';
  for (const LinePart& part : parts) line += (&part == parts.data() ? "" : "  ") + part.text;
  return line.substr(0, columns);
}

ProgressBar::ProgressBar(std::uint64_t steps, std::uint64_t log_every, bool quiet)
    : steps_(steps), log_every_(log_every), quiet_(quiet), terminal_(isatty(STDERR_FILENO)) {}

void ProgressBar::loading(int done, int total) {
  if (quiet_ || !terminal_ || total == 0) return;
  draw("images", double(done) / total, {{fmt::format("{}/{}", done, total), 1}});
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
  std::vector<LinePart> parts{{fmt::format("{}/{}", done, total), 1}};
  if (done > 0 && passed > 5)
    parts.push_back({fmt::format("about {} left", duration(passed * (total - done) / done)), 0});
  draw(name, double(done) / total, std::move(parts));
}

void ProgressBar::training(const train::Progress& p) {
  if (quiet_) return;
  if (p.pace < pace_) ms_ = 0;  // images became larger: earlier times no longer apply
  pace_ = p.pace;
  ms_ = ms_ == 0 ? p.ms_per_step : 0.8 * ms_ + 0.2 * p.ms_per_step;
  const double left = 1e-3 * ms_ * p.pace * static_cast<double>(steps_ - p.step);
  const std::vector<LinePart> parts{{fmt::format("{}/{}", p.step, steps_), 5},
                                    {fmt::format("loss {:.4f}", p.loss), 1},
                                    {p.psnr ? fmt::format("PSNR {:.2f}", *p.psnr) : "PSNR -", 4},
                                    {fmt::format("{} triangles", p.triangles), 2},
                                    {fmt::format("{:.1f} ms/step", ms_), 0},
                                    {fmt::format("{} left", duration(left)), 3}};
  if (terminal_) {
    share_ = double(p.step) / double(steps_);
    parts_ = parts;
    part_.clear();
    draw("", share_, parts);
  } else if (log_every_ > 0 && (p.step % log_every_ == 0 || p.step == steps_)) {
    std::string line;
    for (const LinePart& part : parts) line += (line.empty() ? "" : "  ") + part.text;
    std::fprintf(stderr, "%s\n", line.c_str());
  }
}

void ProgressBar::part(train::Part part) {
  const std::string name = part == train::Part::steps ? "" : train::to_string(part);
  if (quiet_ || !terminal_ || parts_.empty() || name == part_) return;
  part_ = name;
  draw(name, share_, parts_);
}

void ProgressBar::draw(const std::string& name, double share, std::vector<LinePart> parts) {
  std::fprintf(stderr, "\r\033[K%s", fitted_line(name, share, std::move(parts), columns_now()).c_str());
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressBar::clear() {
  if (drawn_) std::fprintf(stderr, "\r\033[K");
  drawn_ = false;
}

}  // namespace trisoup
