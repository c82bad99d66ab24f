#include "live.h"

#include <algorithm>

namespace trisoup::viewer {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kShare = 0.05;  // largest share of the training's time spent on the window

}  // namespace

void Live::begin(Setting setting) {
  std::lock_guard lock(mutex_);
  state_.phase = "training";
  state_.steps = setting.steps;
  state_.budget = setting.budget;
  setting_ = std::move(setting);
  news_ = true;
}

void Live::report(const Point& point, std::uint32_t triangles, double ms_per_step) {
  std::lock_guard lock(mutex_);
  state_.step = point.step;
  state_.triangles = triangles;
  state_.ms_per_step = ms_per_step;
  state_.loss.push_back(static_cast<float>(point.loss));
  if (point.psnr) state_.psnr.push_back(static_cast<float>(*point.psnr));
  news_ = true;
}

void Live::phase(const std::string& text) {
  std::lock_guard lock(mutex_);
  state_.phase = text;
  news_ = true;
}

void Live::end(const std::string& error, bool quit) {
  std::lock_guard lock(mutex_);
  state_.ended = true;
  state_.quit = quit;
  state_.error = error;
  news_ = true;
}

std::uint64_t Live::until(std::uint64_t step, const std::function<soup::Model()>& model) {
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - last_model_).count(); };
  std::unique_lock lock(mutex_);
  state_.step = step;
  // Seconds until the next model is due; a whole interval while the window has not shown the last one.
  constexpr double interval = std::chrono::duration<double>(kInterval).count();
  const auto next = [&] {
    return fresh_ ? std::max(interval, (model_seconds_ + shown_seconds_) / kShare) - since() : interval;
  };
  const auto give = [&] {
    lock.unlock();
    const auto start = Clock::now();
    soup::Model now = model();
    const double took = std::chrono::duration<double>(Clock::now() - start).count();
    publish(std::move(now));
    lock.lock();
    model_seconds_ = took;
  };
  if (!closed_ && (state_.paused || next() <= 0)) give();
  // Signals do not notify changed_, so stop_ is polled.
  while (state_.paused && single_steps_ == 0 && !closed_ && !stop_)
    changed_.wait_for(lock, std::chrono::milliseconds(100));
  if (single_steps_ > 0) {
    --single_steps_;
    return step + 1;
  }
  // Returns within 50 ms, so that buttons respond and the next model is on time.
  const double steps = 1e3 * std::clamp(next(), 0.0, 0.05) / std::max(0.01, state_.ms_per_step);
  return closed_ ? ~std::uint64_t(0) : step + std::max<std::uint64_t>(1, static_cast<std::uint64_t>(steps));
}

void Live::publish(soup::Model model) {
  std::lock_guard lock(mutex_);
  model_ = std::make_shared<const soup::Model>(std::move(model));
  fresh_ = false;
  last_model_ = Clock::now();
  news_ = true;
}

bool Live::running() const {
  std::lock_guard lock(mutex_);
  return !state_.paused && !state_.ended;
}

Live::State Live::state() const {
  std::lock_guard lock(mutex_);
  return state_;
}

std::optional<Live::Setting> Live::take_setting() {
  std::lock_guard lock(mutex_);
  return std::exchange(setting_, std::nullopt);
}

std::shared_ptr<const soup::Model> Live::take_model() {
  std::lock_guard lock(mutex_);
  taken_ = taken_ || model_;
  return std::exchange(model_, nullptr);
}

void Live::pause(bool paused) {
  std::lock_guard lock(mutex_);
  state_.paused = paused;
  changed_.notify_all();
}

void Live::step_once() {
  std::lock_guard lock(mutex_);
  state_.paused = true;
  ++single_steps_;
  changed_.notify_all();
}

void Live::shown(double seconds) {
  std::lock_guard lock(mutex_);
  if (!std::exchange(taken_, false)) return;
  shown_seconds_ = seconds;
  fresh_ = true;
}

void Live::close() {
  std::lock_guard lock(mutex_);
  closed_ = true;
  state_.paused = false;
  changed_.notify_all();
}

}  // namespace trisoup::viewer
