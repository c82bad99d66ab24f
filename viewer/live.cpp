#include "live.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace trisoup::viewer {
namespace {

double seconds_of(std::chrono::steady_clock::duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

/// A whole interval while the last model has not been shown.
double Live::Onlooker::next(double model_seconds) const {
  const double least = seconds_of(interval);
  if (!fresh) return least;
  return std::max(least, (model_seconds + shown_seconds) / share) - seconds_of(Clock::now() - last_model);
}

void Live::Onlooker::give(std::shared_ptr<const soup::Model> next) {
  model = std::move(next);
  fresh = false;
  last_model = Clock::now();
}

std::shared_ptr<const soup::Model> Live::Onlooker::take() {
  taken = taken || model;
  return std::exchange(model, nullptr);
}

void Live::Onlooker::shown(double seconds) {
  if (!std::exchange(taken, false)) return;
  shown_seconds = seconds;
  fresh = true;
}

void Live::begin(Setting setting) {
  std::lock_guard lock(mutex_);
  state_.phase = "training";
  state_.steps = setting.steps;
  state_.budget = setting.budget;
  setting_ = new_setting_ = std::move(setting);
  news_ = true;
}

void Live::report(const Point& point, std::uint32_t triangles, double ms_per_step, double pace) {
  std::lock_guard lock(mutex_);
  state_.step = point.step;
  state_.triangles = triangles;
  state_.ms_per_step = ms_per_step;
  state_.pace = pace;
  state_.points.push_back(point);
  state_.loss.push_back(static_cast<float>(point.loss));
  if (point.psnr) state_.psnr.push_back(static_cast<float>(*point.psnr));
  news_ = true;
}

void Live::evaluated(const Evaluated& evaluated) {
  std::lock_guard lock(mutex_);
  state_.evaluations.push_back(evaluated);
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
  if (error.empty()) state_.phase = "finished";
  state_.quit = quit;
  state_.error = error;
  news_ = true;
}

bool Live::page_is_looked_at() const { return Clock::now() - looked_at_ < kPageLooks; }

double Live::next() const {
  double seconds = std::numeric_limits<double>::infinity();
  if (window_.present) seconds = window_.next(model_seconds_);
  if (page_is_looked_at()) seconds = std::min(seconds, page_.next(model_seconds_));
  return seconds;
}

std::uint64_t Live::until(std::uint64_t step, const Tasks& tasks) {
  std::unique_lock lock(mutex_);
  state_.step = step;
  const auto unlocked = [&](auto&& work) {
    lock.unlock();
    auto result = work();
    lock.lock();
    return result;
  };
  const auto give = [&](bool to_all) {
    const auto start = Clock::now();
    const auto now = std::make_shared<const soup::Model>(unlocked(tasks.model));
    for (Onlooker* onlooker : {&window_, &page_})
      if (to_all || onlooker->next(model_seconds_) <= 0) onlooker->give(now);
    model_seconds_ = seconds_of(Clock::now() - start);
    news_ = true;
    changed_.notify_all();
  };
  if (state_.paused || next() <= 0) give(state_.paused);
  // Signals do not notify changed_, so stop_ is polled.
  do {
    if (std::exchange(save_, false)) state_.message = unlocked(tasks.save), news_ = true;
  } while (state_.paused && single_steps_ == 0 && !stop_ &&
           (changed_.wait_for(lock, std::chrono::milliseconds(100)), true));
  if (single_steps_ > 0) {
    --single_steps_;
    return step + 1;
  }
  if (!window_.present && !page_is_looked_at()) return ~std::uint64_t(0);
  // A window's buttons respond within 50 ms; a page waits longer for answers anyway.
  const double steps = 1e3 * std::clamp(next(), 0.0, window_.present ? 0.05 : 0.5) / std::max(0.01, state_.ms_per_step);
  return step + std::max<std::uint64_t>(1, static_cast<std::uint64_t>(steps));
}

void Live::publish(soup::Model model) {
  const auto shared = std::make_shared<const soup::Model>(std::move(model));
  std::lock_guard lock(mutex_);
  window_.give(shared);
  page_.give(shared);
  news_ = true;
  changed_.notify_all();
}

void Live::give_photographs(std::function<std::optional<Image>(std::size_t camera)> photographs) {
  std::lock_guard lock(photographs_mutex_);
  photographs_ = std::move(photographs);
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
  return std::exchange(new_setting_, std::nullopt);
}

std::shared_ptr<const soup::Model> Live::take_model() {
  std::lock_guard lock(mutex_);
  return window_.take();
}

void Live::pause(bool paused) {
  std::lock_guard lock(mutex_);
  state_.paused = paused;
  news_ = true;
  changed_.notify_all();
}

void Live::step_once() {
  std::lock_guard lock(mutex_);
  state_.paused = true;
  ++single_steps_;
  changed_.notify_all();
}

void Live::save() {
  std::lock_guard lock(mutex_);
  state_.message.clear();
  save_ = true;
  changed_.notify_all();
}

void Live::shown(double seconds) {
  std::lock_guard lock(mutex_);
  window_.shown(seconds);
}

void Live::close() {
  std::lock_guard lock(mutex_);
  window_.present = false;
  state_.paused = false;
  changed_.notify_all();
}

void Live::look() {
  std::lock_guard lock(mutex_);
  looked_at_ = Clock::now();
}

bool Live::looked_at() const {
  std::lock_guard lock(mutex_);
  return page_is_looked_at();
}

std::optional<Live::Setting> Live::setting() const {
  std::lock_guard lock(mutex_);
  return setting_;
}

std::shared_ptr<const soup::Model> Live::wait_for_model(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, stop, [&] { return page_.model != nullptr; });
  return page_.take();
}

void Live::sent(double seconds) {
  std::lock_guard lock(mutex_);
  page_.shown(seconds);
}

bool Live::all_sent() const {
  std::lock_guard lock(mutex_);
  return page_.fresh;
}

std::optional<Image> Live::photograph(std::size_t camera) const {
  std::lock_guard lock(photographs_mutex_);
  return photographs_ ? photographs_(camera) : std::nullopt;
}

}  // namespace trisoup::viewer
