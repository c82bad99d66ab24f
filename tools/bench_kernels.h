// soup-bench kernels: resources of each kernel on a device, and how many of its workgroups can run at once.
#pragma once

#include <cstdint>
#include <string>

#include "gpu/device.h"

namespace trisoup::bench {

struct KernelsOptions {
  std::string csv;  // output file; empty: none
};

/// Returns how many workgroups fit on a multiprocessor with `kilobytes` KB of shared memory, 2048 threads and at most
/// 32 workgroups, ignoring registers. NVIDIA cards with more than 64 KB reserve 1 KB per workgroup.
std::uint32_t groups_by_shared_memory(std::uint32_t kilobytes, std::uint32_t threads, std::uint32_t shared_bytes);

/// Prints one row per kernel and values of its constants (engine/gpu/kernel_variants.cmake) that the device has. Throws
/// Error.
void kernels(gpu::Device& gpu, const KernelsOptions& options);

}  // namespace trisoup::bench
