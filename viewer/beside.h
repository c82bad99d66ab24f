// Runs long work in a second thread, so that the window's thread keeps answering events.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace trisoup::viewer {

/// Runs one piece of work at a time in its own thread. The work reports its progress as text. Until done() is true or
/// end() returns, no other thread may use the device that the work uses.
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
  /// True between begin() and end().
  bool busy() const { return work_.valid(); }
  bool done() const { return done_within(std::chrono::seconds(0)); }
  /// Waits at most `time`; true if the work has finished.
  bool done_within(std::chrono::milliseconds time) const { return work_.wait_for(time) == std::future_status::ready; }
  /// The latest progress text, or nullopt if there is none since the last call.
  std::optional<std::string> news() {
    std::lock_guard lock(mutex_);
    return std::exchange(said_, std::nullopt);
  }
  /// Waits for the work and rethrows its exception.
  void end() { work_.get(); }

 private:
  std::mutex mutex_;
  std::optional<std::string> said_;
  std::future<void> work_;  // last member: its destructor waits while the others still exist
};

}  // namespace trisoup::viewer
