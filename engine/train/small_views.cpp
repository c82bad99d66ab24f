#include "train/small_views.h"

#include <algorithm>
#include <cmath>

#include "scene/area_resample.h"

namespace trisoup::train {

double small_scale(const scene::Camera& camera, const Settings& settings) {
  return std::clamp(64.0 / std::sqrt(double(camera.width) * camera.height), settings.small_scale, 1.0);
}

SmallViews small_views(gpu::Device& gpu, const std::vector<scene::View>& views, const Settings& settings) {
  SmallViews small;
  for (const scene::View& v : views) {
    BatchView view = batch_view(v.camera, settings.near, settings.far, small_scale(v.camera, settings));
    view.index = static_cast<std::uint32_t>(small.views.size());
    const scene::Photograph smaller = scene::area_resample(scene::from_mask(v.image), static_cast<int>(view.width), static_cast<int>(view.height));
    small.images.push_back(scene::composite(smaller, 0));
    small.views.push_back(view);
  }
  small.photographs = upload_photographs(gpu, small.images);
  for (BatchView& view : small.views) view.photo = small.photographs.addresses[view.index];
  return small;
}

}  // namespace trisoup::train
