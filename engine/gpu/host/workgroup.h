// A workgroup on one thread of the CPU: its threads, or as many at once as the kernel has lanes, are fibers that take
// turns at barriers.
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
  /// Fibers 0 to fibers_ - 1 run in turn, each to the next barrier: from one straight to the next.
  void make_fibers(std::size_t count);
  void pass_on();
  void arrived(std::uint32_t fiber, boost::context::fiber from);

  std::vector<boost::context::fiber> waiting_;  // empty: it runs
  boost::context::fiber caller_;                // of run()
  std::uint32_t current_ = 0, fibers_ = 0;
  std::uint32_t left_ = 0;  // fibers that have not finished
  std::uint64_t run_ = 0;   // number of this run()
  const CompiledKernel* kernel_ = nullptr;
  const std::byte* arguments_ = nullptr;
};

}  // namespace trisoup::gpu::host
