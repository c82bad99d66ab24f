// Ends long work early when its caller no longer wants the result.
#pragma once

#include <chrono>
#include <functional>
#include <utility>

namespace trisoup {

/// Asks a function at most twenty times a second, and no more once it has answered true.
class CancellationPoll {
 public:
  /// cancelled: null: never.
  explicit CancellationPoll(std::function<bool()> cancelled) : cancelled_(std::move(cancelled)) {}
  bool ask();

 private:
  std::function<bool()> cancelled_;
  std::chrono::steady_clock::time_point next_{};
  bool found_ = false;
};

/// Thrown by check_cancellation(). It is not an Error: nothing is wrong, and work that survives errors must not go on.
struct Cancelled {};

/// While the object exists, work of this thread can be cancelled. Scopes may be nested; the innermost is asked.
class CancellationScope {
 public:
  explicit CancellationScope(std::function<bool()> cancelled);
  ~CancellationScope();
  CancellationScope(const CancellationScope&) = delete;
  CancellationScope& operator=(const CancellationScope&) = delete;

 private:
  friend void check_cancellation();
  CancellationPoll poll_;
  CancellationScope* outer_;
};

/// Throws Cancelled if the innermost scope of this thread says so. parallel_for(), kernel launches and waiting for
/// other programs call it.
void check_cancellation();

}  // namespace trisoup
