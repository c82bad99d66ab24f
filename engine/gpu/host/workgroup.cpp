#include "gpu/host/workgroup.h"

#include <boost/context/fixedsize_stack.hpp>

#include "gpu/host/invocation.h"

namespace trisoup::gpu::host {
namespace {

// The largest kernel keeps a few kilobytes; sanitizers put red zones between its variables.
constexpr std::size_t kStackBytes = 256 << 10;

thread_local Workgroup* running = nullptr;

}  // namespace

constinit thread_local Invocation invocation;

void barrier() {
  boost::context::fiber& scheduler = running->threads_[running->current_].scheduler;
  scheduler = std::move(scheduler).resume();
}

void Workgroup::make_threads(std::size_t count) {
  for (std::size_t i = threads_.size(); i < count; ++i) {
    threads_.emplace_back();
    // A fiber lives as long as the workgroup and runs thread i of kernel after kernel.
    threads_[i].own = boost::context::fiber(std::allocator_arg, boost::context::fixedsize_stack(kStackBytes),
                                            [this, i](boost::context::fiber&& scheduler) {
                                              threads_[i].scheduler = std::move(scheduler);
                                              for (;;) {
                                                kernel_->run(arguments_);
                                                threads_[i].done = true;
                                                threads_[i].scheduler = std::move(threads_[i].scheduler).resume();
                                              }
                                              return std::move(threads_[i].scheduler);
                                            });
  }
}

void Workgroup::run(const CompiledKernel& kernel, const std::byte* arguments, std::uint32_t group) {
  invocation.group = group;
  if (!kernel.barriers) {
    for (invocation.thread = 0; invocation.thread < kernel.threads; invocation.thread += kernel.lanes) kernel.run(arguments);
    return;
  }
  const std::uint32_t fibers = kernel.threads / kernel.lanes;
  make_threads(fibers);
  kernel_ = &kernel;
  arguments_ = arguments;
  running = this;
  for (std::uint32_t t = 0; t < fibers; ++t) threads_[t].done = false;
  for (bool left = true; left;) {
    left = false;
    for (std::uint32_t t = 0; t < fibers; ++t) {
      if (threads_[t].done) continue;
      current_ = t;
      invocation.thread = t * kernel.lanes;
      threads_[t].own = std::move(threads_[t].own).resume();
      left = left || !threads_[t].done;
    }
  }
}

}  // namespace trisoup::gpu::host
