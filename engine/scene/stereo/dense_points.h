// Points of a scene's surfaces from the depth maps of its photographs.
#pragma once

#include <span>

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Points where the depth maps of two views agree, with all views whose maps agree; if four of these match well, with
/// those that match well. A pixel whose surface has a point already is passed over, so surfaces have about one point
/// per pixel. Planes that match well and on which three views agree come first; others only fill what these leave open.
/// A measured depth needs no other view, unless one looks through its point. colours and errors are empty.
Points dense_points(std::span<const DepthMap> maps);

/// Adds to the sightings of each point the views whose depth maps have a surface there, and removes those whose maps
/// have one clearly elsewhere: views that a reconstruction did not list see a point too, and a mismatch is contradicted
/// by the surfaces behind it. Points that no three views are left of are dropped. points.seen_by may be empty.
Points checked_sightings(const Points& points, std::span<const DepthMap> maps);

}  // namespace trisoup::scene
