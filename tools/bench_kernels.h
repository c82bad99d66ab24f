// soup-bench kernels: what each kernel takes of a device, and so how many of its workgroups run at once.
#pragma once

#include <cstdint>
#include <string>

#include "gpu/device.h"

namespace trisoup::bench {

struct KernelsOptions {
  std::string csv;  // file; empty: none
};

/// Workgroups that fit on a multiprocessor with that many KB of shared memory, 2048 threads and 32 workgroups, if
/// registers do not count. NVIDIA's cards with more than 64 KB keep 1 KB of it for each workgroup.
std::uint32_t groups_by_shared_memory(std::uint32_t kilobytes, std::uint32_t threads, std::uint32_t shared_bytes);

/// Prints a row for each kernel and choice of its constants (engine/gpu/kernel_variants.cmake) that the device has.
/// Throws Error.
void kernels(gpu::Device& gpu, const KernelsOptions& options);

}  // namespace trisoup::bench
