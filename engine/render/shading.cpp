#include "render/shading.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <span>
#include <vector>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::render {
namespace {

constexpr std::array<const char*, 3> kShadingNames{"auto", "fragment", "compute"};
constexpr std::uint32_t kMeasuredWidth = 640, kMeasuredHeight = 360;
// The kernel is used if it takes less than this fraction of the fragment shader's time. Smaller differences may be
// noise.
constexpr double kWorthwhile = 0.9;

/// Returns the triangle image used for measuring: squares of 12 x 12 pixels, each with a random triangle of the model.
std::vector<std::uint32_t> covered_picture(std::uint32_t triangles) {
  std::vector<std::uint32_t> hits;
  hits.reserve(std::size_t(kMeasuredWidth) * kMeasuredHeight);
  for (std::uint32_t y = 0; y < kMeasuredHeight; ++y)
    for (std::uint32_t x = 0; x < kMeasuredWidth; ++x) {
      const std::uint32_t square = y / 12 * (kMeasuredWidth / 12) + x / 12;
      hits.push_back(1 + static_cast<std::uint32_t>(std::uint64_t(square * 0x9e3779b9u) * triangles >> 32));
    }
  return hits;
}

/// Returns the median time per picture of fragment and compute shading, milliseconds.
std::array<double, 2> shading_times(gpu::Device& gpu, gpu::Draw& shade, std::uint32_t triangles) {
  gpu::Graphics& graphics = gpu::graphics_of(gpu);
  const gpu::Image hits =
      graphics.create_image({gpu::Format::r32_uint, kMeasuredWidth, kMeasuredHeight}, "visible triangles");
  const gpu::Image picture = graphics.create_image({gpu::Format::rgba8, kMeasuredWidth, kMeasuredHeight}, "picture");
  const std::vector<std::uint32_t> covered = covered_picture(triangles);
  graphics.upload(hits, 0, std::as_bytes(std::span(covered)));
  shade.textures[0] = &hits;
  shade.depth = gpu::Depth::off;
  const gpu::Compute kernel = as_kernel(shade);
  const gpu::Targets targets{.colour = {&picture}};
  const auto time = [&](int way, int pictures) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < pictures; ++i) way == 0 ? graphics.draw(targets, shade) : graphics.compute(kernel, picture);
    gpu.wait();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() / pictures;
  };
  // The driver compiles during the first picture of each method. The second determines how many pictures to submit at
  // once, so that the cost of a submission is small in comparison.
  double slower = 0;
  for (int i = 0; i < 2; ++i) slower = std::max(time(0, 1), time(1, 1));
  const int pictures = static_cast<int>(std::clamp(2.0 / slower, 1.0, 16.0));
  const int samples = slower < 10 ? 5 : 3;
  std::array<std::vector<double>, 2> times;
  // Alternating exposes both methods equally to load spikes and clock changes.
  for (int i = 0; i < samples; ++i)
    for (int way = 0; way < 2; ++way) times[way].push_back(time(way, pictures));
  for (std::vector<double>& t : times) std::sort(t.begin(), t.end());
  return {times[0][samples / 2], times[1][samples / 2]};
}

}  // namespace

const char* to_string(Shading shading) { return kShadingNames[static_cast<std::size_t>(shading)]; }
std::optional<Shading> shading_from(std::string_view name) {
  for (std::size_t i = 0; i < kShadingNames.size(); ++i)
    if (name == kShadingNames[i]) return static_cast<Shading>(i);
  return {};
}

Shading asked_shading() {
  const char* const asked = std::getenv("TRISOUP_SHADING");
  if (!asked) return Shading::automatic;
  if (const auto shading = shading_from(asked)) return *shading;
  throw Error("TRISOUP_SHADING={}: unknown value; use auto, fragment or compute", printable(asked));
}

gpu::Compute as_kernel(const gpu::Draw& shade) {
  return {.kernel = std::string_view(shade.fragment) == "shade_fixed" ? "shade_picture_fixed" : "shade_picture",
          .constants = shade.constants,
          .textures = shade.textures,
          .uniforms = shade.uniforms};
}

std::optional<Shading> measured_shading(gpu::Device& gpu, gpu::Draw shade, std::uint32_t triangles) {
  try {
    const auto [fragment, compute] = shading_times(gpu, shade, triangles);
    return compute < kWorthwhile * fragment ? Shading::compute : Shading::fragment;
  } catch (const Error&) {
    // Out of memory for another picture, or the driver cannot compile the kernel. Fragment shading needs neither.
    return {};
  }
}

}  // namespace trisoup::render
