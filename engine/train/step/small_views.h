// Smaller versions of the training views.
#pragma once

#include <vector>

#include "train/config/settings.h"
#include "train/step/batch_view.h"
#include "train/step/photographs.h"

namespace trisoup::train {

/// The views of a training's first steps, up to small_end(). Few pixels suffice to learn coarse geometry and colours.
struct SmallViews {
  std::vector<Image> images;  // of each training view, RGBA8, alpha is the loss mask
  Photographs photographs;    // the images in device memory
  std::vector<BatchView> views;
};

/// Factor of a view's width and height: small_scale(), but at least the area of 64 x 64 pixels, because coarser pixels
/// would miss triangles.
double small_view_scale(const scene::Camera& camera, const Settings& settings);

/// Scales every view down by area averaging (scene/lens/area_resample.h). A view keeps its size if its mask would
/// become empty. Throws gpu::OutOfMemory.
SmallViews small_views(gpu::Device& gpu, const std::vector<scene::View>& views, const Settings& settings);

}  // namespace trisoup::train
