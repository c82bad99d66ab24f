// Masks out what photographs show of the triangles that were removed from a model.
#pragma once

#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Mean share of the pixels, 0..1, of which mask_removed() leaves the photographs out.
struct RemovedShares {
  double train = 0, test = 0;
};

/// Draws `original` for every view of `scene` and masks out the pixels that show a removed triangle, with a margin of
/// two pixels, because edges of a model and of its photograph differ a little. In training views those behind which
/// `cleaned`, the model that remains, shows nothing become background, but for another such margin: else nothing would
/// keep the edges of what remains from growing there. Fills Scene::whole. removed: [triangles of the original]. A
/// photograph that is not decoded becomes its mask.
RemovedShares mask_removed(gpu::Device& gpu, scene::Scene& scene, const soup::Model& original,
                           const std::vector<bool>& removed, const soup::Model& cleaned, const Settings& settings);

}  // namespace trisoup::train
