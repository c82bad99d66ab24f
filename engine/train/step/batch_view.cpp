#include "train/step/batch_view.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "soup/random.h"

namespace trisoup::train {
namespace {

/// Interpolation weights of the pixels at -1, 0, 1 and 2 for a sample at f in [0, 1): cubic (Catmull and Rom 1974; Keys
/// 1981 with a = -1/2), rounded to multiples of 1/128.
glm::vec4 taps_at(double f) {
  const auto rounded = [](double weight) { return std::round(weight * 128.0) / 128.0; };
  const double before = rounded(-0.5 * f * (1 - f) * (1 - f)), after = rounded(-0.5 * f * f * (1 - f)),
               next = rounded(f * (0.5 + f * (2.0 - 1.5 * f)));
  return {before, 1.0 - before - next - after, next, after};
}

}  // namespace

BatchView batch_view(const scene::Camera& camera, double near, double far, double scale) {
  const auto side = [&](int n) { return std::max(1, static_cast<int>(std::lround(n * scale))); };
  const scene::Camera sized = scene::resized(camera, side(camera.width), side(camera.height));
  BatchView view;
  view.width = sized.width;
  view.height = sized.height;
  look_from(view, camera, near, far);
  view.photograph_pixels = double(camera.width) * camera.height / (double(sized.width) * sized.height);
  return view;
}

void look_from(BatchView& view, const scene::Camera& camera, double near, double far) {
  const scene::Camera sized = scene::resized(camera, static_cast<int>(view.width), static_cast<int>(view.height));
  view.clip_from_world = scene::clip_from_world(sized, near, far);
  view.world_from_clip = glm::inverse(view.clip_from_world);
}

BatchView sampled_at(const BatchView& view, glm::dvec2 pixels) {
  BatchView moved = view;
  moved.offset += pixels;
  return moved;
}

glm::dvec2 pixel_jitter(std::uint64_t seed, std::uint64_t step, const BatchView& view, double max_offset) {
  constexpr std::uint64_t kStream = 0x6a6974746572;  // "jitter"
  soup::Random random(seed ^ (kStream << 16), step);
  random.seek(std::uint64_t(view.index) * 2);
  const double x = random.uniform01(), y = random.uniform01();
  // A single pixel has no neighbours to interpolate with.
  return max_offset * glm::dvec2(view.width > 1 ? 2.0 * x - 1.0 : 0.0, view.height > 1 ? 2.0 * y - 1.0 : 0.0);
}

std::uint32_t random_background(std::uint64_t seed, std::uint64_t step, const BatchView& view, double share) {
  if (share <= 0) return 0;
  constexpr std::uint64_t kStream = 0x6261636b;  // "back"
  soup::Random random(seed ^ (kStream << 24), step);
  random.seek(std::uint64_t(view.index) * 4);
  if (random.uniform01() >= share) return 0;
  std::uint32_t rgba = 0xff000000u;
  for (std::uint32_t shift = 0; shift < 24; shift += 8)
    rgba |= std::min(255u, static_cast<std::uint32_t>(random.uniform01() * 256.0)) << shift;
  return rgba;
}

BatchLayout lay_out(std::span<const BatchView> views) {
  BatchLayout layout;
  layout.views = static_cast<std::uint32_t>(views.size());
  for (const BatchView& view : views) {
    kernels::ViewRecord record{};
    // Round to float before applying the offset. Otherwise the result would depend on digits of the pose that are lost
    // if the scene is far from the origin.
    const glm::dvec2 ndc = 2.0 * view.offset / glm::dvec2(view.width, view.height);
    record.clip_from_world = glm::mat4(view.clip_from_world);
    record.clip_from_world =
        glm::mat4(glm::translate(glm::dmat4(1.0), glm::dvec3(-ndc, 0.0)) * glm::dmat4(record.clip_from_world));
    const scene::PixelRays rays = scene::pixel_rays(view.world_from_clip);
    record.ray_x = glm::vec4(rays.x, 0.0);
    record.ray_y = glm::vec4(rays.y, 0.0);
    record.ray = glm::vec4(rays.centre, 0.0);
    record.ray =
        glm::vec4(glm::dvec4(record.ray) + ndc.x * glm::dvec4(record.ray_x) + ndc.y * glm::dvec4(record.ray_y));
    const double inverse_w = view.world_from_clip[3].w, by_z = view.world_from_clip[2].w;
    record.eye_shift = glm::vec4(view.eye_shift * (1.0 / (inverse_w + by_z) - 1.0 / (inverse_w - by_z)), 0.0);
    record.inverse_w = static_cast<float>(inverse_w);
    record.inverse_w_by_z = static_cast<float>(by_z);
    record.width = view.width;
    record.height = view.height;
    record.tiles_x = (view.width + 7) / 8;
    record.tiles_y = (view.height + 7) / 8;
    record.pixel_offset = layout.pixels;
    record.tile_offset = layout.tiles;
    record.block_offset = layout.blocks;
    record.photo = view.photo;
    record.depth = view.depth;
    record.depth_size = view.depth_width | view.depth_height << 16;
    record.index = view.index;
    record.background = view.background;
    record.photograph_pixels = static_cast<float>(view.photograph_pixels);
    const glm::dvec2 whole = glm::floor(view.offset);
    record.first_x = static_cast<int>(whole.x) - 1;
    record.first_y = static_cast<int>(whole.y) - 1;
    record.taps_x = taps_at(view.offset.x - whole.x);
    record.taps_y = taps_at(view.offset.y - whole.y);
    layout.records.push_back(record);
    layout.pixels += view.width * view.height;
    layout.tiles += record.tiles_x * record.tiles_y;
    layout.blocks += ((view.width + 15) / 16) * ((view.height + 15) / 16);
    if (view.width > 10 && view.height > 10) layout.windows += std::uint64_t(view.width - 10) * (view.height - 10);
  }
  return layout;
}

}  // namespace trisoup::train
