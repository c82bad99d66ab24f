// How the second pass of a picture runs if it has one sample a pixel: as a fragment shader or as a kernel.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "gpu/graphics.h"

namespace trisoup::render {

/// automatic: the faster one on the device. Pictures are the same, but for the last bit of a colour if a driver fuses
/// products and sums differently for kernels.
enum class Shading { automatic, fragment, compute };
const char* to_string(Shading shading);  // auto, fragment, compute
std::optional<Shading> shading_from(std::string_view name);

/// The environment variable TRISOUP_SHADING, for tests and measurements: auto, fragment or compute; automatic if it is
/// not set. Throws Error for any other word.
Shading asked_shading();

/// The kernel that shades as a draw with shade.frag does.
gpu::Compute as_kernel(const gpu::Draw& shade);

/// Shading is measured with pictures and models of at least this size: smaller ones take no time worth a choice.
inline constexpr std::uint32_t kLeastPixels = 800'000, kLeastTriangles = 500;

/// Times both ways in turn on a picture of 640 x 360 that the model's triangles cover, and returns the faster one;
/// fragment if both take about as long. Empty if the device cannot do both. shade: a draw with shade.frag for this
/// model. triangles: of the model, at least 1. Waits: some ten milliseconds on a GPU, half a second on a CPU, and the
/// time in which the driver compiles.
std::optional<Shading> measured_shading(gpu::Device& gpu, gpu::Draw shade, std::uint32_t triangles);

}  // namespace trisoup::render
