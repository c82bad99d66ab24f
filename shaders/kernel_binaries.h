// SPIR-V of the kernels, embedded at build time.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace trisoup::gpu {

/// SPIR-V words of shaders/<name>.comp; empty when there is no such kernel.
std::span<const std::uint32_t> kernel_binary(std::string_view name);

}  // namespace trisoup::gpu
