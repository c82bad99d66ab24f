// Kernels that a C++ or CUDA compiler has made part of this program, one for each choice of their specialisation
// constants (kernel_variants.cmake lists them).
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
  bool first_is_length;   // constant 0 is the length of an array: a longer one will do
  bool barriers;          // its threads wait for each other
  std::uint32_t threads;  // of a workgroup
  std::size_t argument_bytes;
  Run* run;
  std::uint32_t lanes = 1;         // threads of a workgroup that a call runs
  const void* function = nullptr;  // CUDA: the kernel itself, as its runtime knows it
};

/// The first of `kernels` that fits; those with shorter arrays come first. Constants that are not given are 0. Throws
/// Error where none does, or takes fewer bytes of arguments.
template <typename Run>
const Compiled<Run>& find_compiled(std::span<const Compiled<Run>> kernels, const Kernel& kernel,
                                   std::size_t argument_bytes);

namespace host {
/// Threads of a workgroup, from the one on that `invocation` names (host/kernel_language.h).
using Run = void(const std::byte* arguments);
using CompiledKernel = Compiled<Run>;
std::span<const CompiledKernel> compiled_kernels();
}  // namespace host

namespace cuda {
/// A launch on a cudaStream_t.
using Run = void(void* stream, std::uint32_t groups, const std::byte* arguments);
using CompiledKernel = Compiled<Run>;
/// Without contraction of products and sums, and with it.
std::span<const CompiledKernel> exact_kernels();
std::span<const CompiledKernel> contracted_kernels();
const std::vector<CompiledKernel>& compiled_kernels();
}  // namespace cuda

}  // namespace trisoup::gpu
