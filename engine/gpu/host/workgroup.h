// A workgroup on one thread of the CPU: its threads, or as many at once as the kernel has lanes, are fibers that take turns at barriers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <boost/context/fiber.hpp>

#include "gpu/compiled_kernels.h"

namespace trisoup::gpu::host {

class Workgroup {
 public:
  Workgroup() = default;
  Workgroup(const Workgroup&) = delete;
  Workgroup& operator=(const Workgroup&) = delete;
  /// Runs one workgroup of a kernel to its end.
  void run(const CompiledKernel& kernel, const std::byte* arguments, std::uint32_t group);

 private:
  friend void barrier();
  struct Thread {
    boost::context::fiber own, scheduler;  // whichever of the two is not running
    bool done = true;
  };
  void make_threads(std::size_t count);
  std::vector<Thread> threads_;
  std::uint32_t current_ = 0;  // the fiber that runs
  const CompiledKernel* kernel_ = nullptr;
  const std::byte* arguments_ = nullptr;
};

}  // namespace trisoup::gpu::host
