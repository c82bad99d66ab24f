// Runs a workgroup on one CPU thread. If the kernel has barriers, its threads (or groups of threads, for kernels with
// lanes) are fibers that switch at barriers.
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
  /// Runs one workgroup of a kernel to completion.
  void run(const CompiledKernel& kernel, const std::byte* arguments, std::uint32_t group);

 private:
  friend void barrier();
  /// Creates missing fibers. Fibers 0 to fibers_ - 1 run in turn, each until its next barrier, and switch directly to
  /// the next fiber.
  void make_fibers(std::size_t count);
  void pass_on();
  void arrived(std::uint32_t fiber, boost::context::fiber from);

  std::vector<boost::context::fiber> waiting_;  // suspended fibers; the entry of the running fiber is empty
  boost::context::fiber caller_;                // the caller of run()
  std::uint32_t current_ = 0, fibers_ = 0;
  std::uint32_t left_ = 0;  // fibers that have not finished
  std::uint64_t run_ = 0;   // counts calls of run()
  const CompiledKernel* kernel_ = nullptr;
  const std::byte* arguments_ = nullptr;
};

}  // namespace trisoup::gpu::host
