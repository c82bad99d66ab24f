// Work that takes long, done beside the thread that answers a window.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace trisoup::viewer {

/// One piece of work at a time, in a thread of its own, which says what it is at. A device or a driver that it uses is
/// its own until end() or until done().
class Beside {
 public:
  using Say = std::function<void(std::string what)>;

  void begin(std::function<void(const Say&)> work) {
    work_ = std::async(std::launch::async, [this, work = std::move(work)] {
      work([this](std::string what) {
        std::lock_guard lock(mutex_);
        said_ = std::move(what);
      });
    });
  }
  /// It was begun, and end() was not called.
  bool busy() const { return work_.valid(); }
  bool done() const { return done_within(std::chrono::seconds(0)); }
  /// Waits for it, no longer than that.
  bool done_within(std::chrono::milliseconds time) const { return work_.wait_for(time) == std::future_status::ready; }
  /// What it said last; once.
  std::optional<std::string> news() {
    std::lock_guard lock(mutex_);
    return std::exchange(said_, std::nullopt);
  }
  /// Waits for it. Throws what it threw.
  void end() { work_.get(); }

 private:
  std::mutex mutex_;
  std::optional<std::string> said_;
  std::future<void> work_;  // the last member: it is waited for before the others go
};

}  // namespace trisoup::viewer
