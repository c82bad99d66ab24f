// Selects how the shading pass runs with one sample per pixel: as a fragment shader or as a compute kernel.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "gpu/graphics.h"

namespace trisoup::render {

/// automatic: the faster one on the device. Both give the same pictures, except for the last bit of a colour if the
/// driver fuses multiplications and additions differently in kernels.
enum class Shading { automatic, fragment, compute };
const char* to_string(Shading shading);  // auto, fragment, compute
std::optional<Shading> shading_from(std::string_view name);

/// Returns the value of the environment variable TRISOUP_SHADING, for tests and measurements: auto, fragment or
/// compute; automatic if it is not set. Throws Error for other values.
Shading asked_shading();

/// Returns the kernel that is equivalent to a draw with shade.frag.
gpu::Compute as_kernel(const gpu::Draw& shade);

/// Shading is measured only with pictures and models of at least this size. For smaller ones the choice does not
/// matter.
inline constexpr std::uint32_t kLeastPixels = 800'000, kLeastTriangles = 500;

/// Measures both methods alternately on a 640 x 360 picture covered by the model's triangles and returns the faster
/// one; fragment if both take about the same time. Empty if the device cannot run both. shade: a draw with shade.frag
/// for this model. triangles: of the model, at least 1. Blocks for about ten milliseconds on a GPU or half a second on
/// a CPU, plus the driver's compile time.
std::optional<Shading> measured_shading(gpu::Device& gpu, gpu::Draw shade, std::uint32_t triangles);

}  // namespace trisoup::render
