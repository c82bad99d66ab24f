// Masks out what photographs show of a model's removed triangles.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Mean share of the pixels, 0..1, that mask_removed() masks out.
struct RemovedShares {
  double train = 0, test = 0;
};

/// Draws `original` for every view of `scene` and masks out the pixels that show a removed triangle, with a margin of
/// two pixels, because edges of a model and of its photograph differ a little. Fills Scene::whole. removed: [triangles
/// of the original]. A photograph that is not decoded becomes its mask.
RemovedShares mask_removed(gpu::Device& gpu, scene::Scene& scene, const soup::Model& original,
                           const std::vector<bool>& removed, const Settings& settings);

}  // namespace trisoup::train
