// Kernels that were compiled into this program as C++ or CUDA, one for each combination of specialisation constants
// listed in kernel_variants.cmake.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "gpu/device.h"

namespace trisoup::gpu {

template <typename Run>
struct Compiled {
  std::string_view name;
  std::vector<std::uint32_t> constants;
  bool first_is_length;   // constant 0 is the length of an array: a longer array also fits
  bool barriers;          // the kernel has barriers
  std::uint32_t threads;  // per workgroup
  std::size_t argument_bytes;
  Run* run;
  std::uint32_t lanes = 1;         // threads that one call runs
  const void* function = nullptr;  // CUDA: the kernel's function pointer
};

/// Returns the first of `kernels` that matches; variants with shorter arrays come first. Constants not given are 0.
/// Throws Error if none matches or if argument_bytes exceeds the size of the kernel's arguments.
template <typename Run>
const Compiled<Run>& find_compiled(std::span<const Compiled<Run>> kernels, const Kernel& kernel,
                                   std::size_t argument_bytes);

namespace host {
/// Runs one or more threads of a workgroup, starting at `invocation` (host/kernel_language.h).
using Run = void(const std::byte* arguments);
using CompiledKernel = Compiled<Run>;
std::span<const CompiledKernel> compiled_kernels();
}  // namespace host

namespace cuda {
/// Launches a kernel on a cudaStream_t.
using Run = void(void* stream, std::uint32_t groups, const std::byte* arguments);
using CompiledKernel = Compiled<Run>;
/// Kernels compiled without and with contraction of products and sums to fused multiply-add.
std::span<const CompiledKernel> exact_kernels();
std::span<const CompiledKernel> contracted_kernels();
const std::vector<CompiledKernel>& compiled_kernels();
}  // namespace cuda

}  // namespace trisoup::gpu
