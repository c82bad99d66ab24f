// Training views at a part of their size.
#pragma once

#include <vector>

#include "train/config/settings.h"
#include "train/step/batch_view.h"
#include "train/step/photographs.h"

namespace trisoup::train {

/// What the first steps of a training look at (small_end): how a surface lies, and colours of corners, show in fewer
/// pixels.
struct SmallViews {
  std::vector<Image> images;  // of each training view, RGBA8, alpha the loss mask
  Photographs photographs;    // the same in device memory
  std::vector<BatchView> views;
};

/// Sides of a view's smaller picture, as a share of its own: small_scale(), but not below 64 x 64 pixels,
/// between which triangles would fall through.
double small_view_scale(const scene::Camera& camera, const Settings& settings);

/// Every view by area (scene/area_resample.h); one whose mask would leave nothing keeps its size. Throws
/// gpu::OutOfMemory.
SmallViews small_views(gpu::Device& gpu, const std::vector<scene::View>& views, const Settings& settings);

}  // namespace trisoup::train
