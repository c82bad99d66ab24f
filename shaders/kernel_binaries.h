// SPIR-V of the kernels and shaders, embedded at build time.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace trisoup::gpu {

/// Returns the SPIR-V words of shaders/<name>.comp, or of a rasterisation shader by its full file name.
/// shade_fixed.frag is shade.frag with FIXED_MLP; shade_picture_fixed is shade_picture.comp with FIXED_MLP. Empty if
/// there is no such shader.
std::span<const std::uint32_t> kernel_binary(std::string_view name);

}  // namespace trisoup::gpu
