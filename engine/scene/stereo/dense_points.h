// Points of a scene's surfaces from the depth maps of its photographs.
#pragma once

#include <span>

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Points where the depth maps of three views agree, or of two where hardly more show the place, with all views whose
/// maps agree. A pixel whose surface an earlier view has given a point is passed over, so surfaces have about one point
/// per pixel of the view that comes first. A measured depth needs no other view, unless one looks through its point.
/// colours and errors are empty.
Points dense_points(std::span<const DepthMap> maps);

/// Adds to the sightings of each point the views whose depth maps have a surface there, and removes those whose maps
/// have one clearly elsewhere: views that a reconstruction did not list see a point too, and a mismatch is contradicted
/// by the surfaces behind it. Points that no three views are left of are dropped. points.seen_by may be empty.
Points checked_sightings(const Points& points, std::span<const DepthMap> maps);

}  // namespace trisoup::scene
