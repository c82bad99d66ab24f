// Computes points of a scene from its photographs and their poses.
#pragma once

#include <span>

#include "scene/scene.h"

namespace trisoup::scene {

/// Finds points for datasets with poses but without points. For the most textured pixel of every 4 x 4 pixel cell, the
/// function sweeps depth along the pixel's ray and compares the patch around it with several neighbouring views by
/// normalised cross-correlation (Collins 1996, "A space-sweep approach to true multi-image matching"). Two views must
/// find a point independently, because a repeated texture may mislead one view.
///
/// views: normalised coordinates, with their photographs. Large photographs are reduced first. threads: 0 means one per
/// core; the result does not depend on it.
/// Returns positions in the same coordinates, colours, and the indices of the matching views in seen_by; errors is
/// empty. Finds no points closer to a camera than an eighth of the cameras' mean distance from the centre. Returns few
/// points or none if nothing matches; throws no Error.
Points points_from_views(std::span<const View> views, int threads = 0);

}  // namespace trisoup::scene
