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
    const scene::Photograph smaller = scene::area_resample(scene::from_mask(v.image), static_cast<int>(view.width), static_cast<int>(view.height));
    small.images.push_back(scene::composite(smaller, 0));
    // A pixel is in the mask where half of its area is, so a mask of specks would leave none.
    if (!has_pixels(small.images.back()) && has_pixels(v.image)) {
      view = batch_view(v.camera, settings.near, settings.far);
      small.images.back() = v.image;
    }
    view.index = static_cast<std::uint32_t>(small.views.size());
    small.views.push_back(view);
  }
  small.photographs = upload_photographs(gpu, small.images);
  for (BatchView& view : small.views) view.photo = small.photographs.addresses[view.index];
  return small;
}

}  // namespace trisoup::train
