#include "train/view_record.h"

#include <algorithm>
#include <cmath>

namespace trisoup::train {
BatchView batch_view(const scene::Camera& camera, double near, double far, double scale) {
  const auto side = [&](int n) { return std::max(1, static_cast<int>(std::lround(n * scale))); };
  const scene::Camera sized = scene::resized(camera, side(camera.width), side(camera.height));
  BatchView view;
  view.clip_from_world = scene::clip_from_world(sized, near, far);
  view.world_from_clip = glm::inverse(view.clip_from_world);
  view.width = sized.width;
  view.height = sized.height;
  view.photograph_pixels = double(camera.width) * camera.height / (double(sized.width) * sized.height);
  return view;
}

BatchLayout lay_out(std::span<const BatchView> views) {
  BatchLayout layout;
  layout.views = static_cast<std::uint32_t>(views.size());
  for (const BatchView& view : views) {
    kernels::ViewRecord record{};
    record.clip_from_world = glm::mat4(view.clip_from_world);
    const scene::PixelRays rays = scene::pixel_rays(view.world_from_clip);
    record.ray = glm::vec4(rays.centre, 0.0);
    record.ray_x = glm::vec4(rays.x, 0.0);
    record.ray_y = glm::vec4(rays.y, 0.0);
    record.width = view.width;
    record.height = view.height;
    record.tiles_x = (view.width + 7) / 8;
    record.tiles_y = (view.height + 7) / 8;
    record.pixel_offset = layout.pixels;
    record.tile_offset = layout.tiles;
    record.block_offset = layout.blocks;
    record.photo = view.photo;
    record.index = view.index;
    record.photograph_pixels = static_cast<float>(view.photograph_pixels);
    layout.records.push_back(record);
    layout.pixels += view.width * view.height;
    layout.tiles += record.tiles_x * record.tiles_y;
    layout.blocks += ((view.width + 15) / 16) * ((view.height + 15) / 16);
    if (view.width > 10 && view.height > 10) layout.windows += std::uint64_t(view.width - 10) * (view.height - 10);
  }
  return layout;
}

}  // namespace trisoup::train
