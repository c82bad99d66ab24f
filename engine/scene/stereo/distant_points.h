// Directions in which photographs show nothing that parallax reaches: sky, and hills on the horizon.
#pragma once

#include <span>

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Points on a sphere round the cameras, so large that none of them is off by a pixel: one for each direction in which
/// two depth maps or more agree that nothing is nearer. seen_by: views whose maps say so, so that a surface built from
/// them has nothing in between. colours, errors: empty. Points::distant: all of them.
Points distant_points(std::span<const DepthMap> maps);

}  // namespace trisoup::scene
