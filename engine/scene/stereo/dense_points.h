// Points of a scene's surfaces from the depth maps of its photographs.
#pragma once

#include <cstddef>
#include <span>

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Points where several views' depth maps agree, with colours and the views that agree. A pixel whose surface an
/// earlier view has given a point is passed over, so that surfaces have about one point per pixel of the view that
/// comes first. errors is empty. views: those of `maps`.
Points dense_points(std::span<const View> views, std::span<const DepthMap> maps);

}  // namespace trisoup::scene
