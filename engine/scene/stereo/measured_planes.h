// Measured depths as planes of depth maps.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Fills in the planes of views with measured depths (View::depth), except where two neighbours agree on one that
/// stereo found. Pixels at edges of a measured map get none. A view without planes gets
/// a map of its own size, at most that of the measured one; all such maps together have about `pixels` pixels. maps: of
/// depth_maps(), or empty.
void add_measured_planes(std::span<const View> views, std::size_t pixels, std::vector<DepthMap>& maps);

}  // namespace trisoup::scene
