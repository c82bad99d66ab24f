#include "gpu/host/workgroup.h"

#include <boost/context/fixedsize_stack.hpp>

#include "gpu/host/invocation.h"

namespace trisoup::gpu::host {
namespace {

// The largest kernel needs a few kilobytes of stack. Sanitizers add red zones between variables.
constexpr std::size_t kStackBytes = 256 << 10;

thread_local Workgroup* running = nullptr;

}  // namespace

constinit thread_local Invocation invocation;

void barrier() { running->pass_on(); }

void Workgroup::make_fibers(std::size_t count) {
  for (std::size_t i = waiting_.size(); i < count; ++i)
    // A fiber lives as long as the Workgroup object and runs one thread (or group of lanes) of every kernel.
    waiting_.emplace_back(std::allocator_arg, boost::context::fixedsize_stack(kStackBytes),
                          [this, i](boost::context::fiber&& from) {
                            arrived(static_cast<std::uint32_t>(i), std::move(from));
                            for (;;) {
                              kernel_->run(arguments_);
                              --left_;
                              const std::uint64_t own_run = run_;
                              // In a faulty kernel, other threads may still have barriers to reach. tests/emulated_cuda
                              // detects such kernels with these fibers.
                              do pass_on();
                              while (run_ == own_run);
                            }
                            return std::move(caller_);
                          });
}

/// Stores the fiber that ran before this one. from: that fiber, as returned by resume().
void Workgroup::arrived(std::uint32_t fiber, boost::context::fiber from) {
  (fiber > 0 ? waiting_[fiber - 1] : caller_ ? waiting_[fibers_ - 1] : caller_) = std::move(from);
}

void Workgroup::pass_on() {
  const std::uint32_t own = current_;
  const bool last = own + 1 == fibers_;
  if (last && left_ == 0) {
    arrived(own, std::move(caller_).resume());
    return;
  }
  if (fibers_ == 1) return;
  current_ = last ? 0 : own + 1;
  invocation.thread = current_ * kernel_->lanes;
  arrived(own, std::move(waiting_[current_]).resume());
}

void Workgroup::run(const CompiledKernel& kernel, const std::byte* arguments, std::uint32_t group) {
  invocation.group = group;
  invocation.thread = 0;
  if (!kernel.barriers) {
    for (; invocation.thread < kernel.threads; invocation.thread += kernel.lanes) kernel.run(arguments);
    return;
  }
  fibers_ = kernel.threads / kernel.lanes;
  make_fibers(fibers_);
  kernel_ = &kernel;
  arguments_ = arguments;
  running = this;
  current_ = 0;
  left_ = fibers_;
  ++run_;
  waiting_[fibers_ - 1] = std::move(waiting_[0]).resume();
}

}  // namespace trisoup::gpu::host
