#include "train/step/small_views.h"

#include <algorithm>
#include <cmath>

#include "base/parallel_for.h"
#include "scene/lens/area_resample.h"
#include "train/config/schedule.h"

namespace trisoup::train {

double small_view_scale(const scene::Camera& camera, const Settings& settings) {
  return std::clamp(64.0 / std::sqrt(double(camera.width) * camera.height), small_scale(settings), 1.0);
}

SmallViews small_views(gpu::Device& gpu, const std::vector<scene::View>& views, const Settings& settings) {
  SmallViews small;
  small.images.resize(views.size());
  small.views.resize(views.size());
  parallel_for(static_cast<int>(views.size()), 0, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const scene::View& v = views[i];
    BatchView view = batch_view(v.camera, settings.near, settings.far, small_view_scale(v.camera, settings));
    const scene::Photograph smaller =
        scene::area_resample(scene::from_view(v.image), static_cast<int>(view.width), static_cast<int>(view.height));
    small.images[i] = scene::composite(smaller, 0);
    // A pixel is in the mask if half of its area is, so a mask of small specks can become empty.
    if (!has_pixels(small.images[i]) && has_pixels(v.image)) {
      view = batch_view(v.camera, settings.near, settings.far);
      small.images[i] = v.image;
    }
    view.index = static_cast<std::uint32_t>(i);
    small.views[i] = view;
  });
  small.photographs = upload_photographs(gpu, small.images);
  for (BatchView& view : small.views) view.photo = small.photographs.addresses[view.index];
  return small;
}

}  // namespace trisoup::train
