// The kernels as functions of this program, one for each choice of their specialisation constants.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace trisoup::gpu::host {

struct CompiledKernel {
  std::string_view name;
  std::vector<std::uint32_t> constants;
  bool first_is_length;  // constant 0 is the length of an array: a longer one will do
  bool barriers;         // its threads wait for each other
  std::uint32_t threads;  // of a workgroup
  std::size_t argument_bytes;
  void (*run)(const std::byte* arguments);  // one thread, the one that `invocation` names
};

std::span<const CompiledKernel> compiled_kernels();

}  // namespace trisoup::gpu::host
