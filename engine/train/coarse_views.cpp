#include "train/coarse_views.h"

#include <algorithm>
#include <cmath>

#include "scene/area_resample.h"

namespace trisoup::train {

double coarse_scale(const scene::Camera& camera, const Settings& settings) {
  return std::clamp(64.0 / std::sqrt(double(camera.width) * camera.height), settings.coarse_scale, 1.0);
}

CoarseViews coarse_views(gpu::Device& gpu, const std::vector<scene::View>& views, const Settings& settings) {
  CoarseViews coarse;
  for (const scene::View& v : views) {
    BatchView view = batch_view(v.camera, settings.near, settings.far, coarse_scale(v.camera, settings));
    view.index = static_cast<std::uint32_t>(coarse.views.size());
    const scene::Photograph smaller = scene::area_resample(scene::from_mask(v.image), static_cast<int>(view.width), static_cast<int>(view.height));
    coarse.images.push_back(scene::composite(smaller, 0));
    coarse.views.push_back(view);
  }
  coarse.photographs = upload_photographs(gpu, coarse.images);
  for (BatchView& view : coarse.views) view.photo = coarse.photographs.addresses[view.index];
  return coarse;
}

}  // namespace trisoup::train
