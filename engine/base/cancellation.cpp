#include "base/cancellation.h"

namespace trisoup {
namespace {

constinit thread_local CancellationScope* innermost_scope = nullptr;

}  // namespace

bool CancellationPoll::ask() {
  if (!cancelled_ || found_) return found_;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return false;
  next_ = now + std::chrono::milliseconds(50);
  return found_ = cancelled_();
}

CancellationScope::CancellationScope(std::function<bool()> cancelled)
    : poll_(std::move(cancelled)), outer_(std::exchange(innermost_scope, this)) {}

CancellationScope::~CancellationScope() { innermost_scope = outer_; }

void check_cancellation() {
  if (innermost_scope && innermost_scope->poll_.ask()) throw Cancelled();
}

}  // namespace trisoup
