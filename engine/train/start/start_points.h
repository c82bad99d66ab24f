// The part of a sparse cloud that a start can rely on.
#pragma once

#include <cstddef>

#include "scene/scene.h"

namespace trisoup::train {

/// The cloud without what cannot be trusted, no more than `most` points of it. Points go that
/// - are farther away than three times the 99th percentile of distances: mismatches near the horizon of some view;
/// - fewer than three views vouch for, or whose reprojection error is above both 2 pixels and twice the median, where
/// that is known;
/// - without tracks, the 3 % that are farthest from their eight neighbours, seen from the cameras (contracted()).
/// A rule that would leave less than a third of the cloud is not applied: then the cloud is sparse, not bad. Where more
/// than `most` are left, each cell of a grid over the contracted room keeps the point that most views saw. Indices into
/// the cloud, ascending.
std::vector<std::uint32_t> usable_points(const scene::Points& points, std::size_t most);

/// Room as the cameras see it: what is within a unit stays as it is, what is without comes to 2 - 1 / distance (Barron
/// et al. 2022, Mip-NeRF 360). Equal lengths there are roughly equal angles here.
glm::dvec3 contracted(const glm::dvec3& p);

/// How far a start reaches and how near its cameras come to what they saw, normalised units.
struct Reach {
  double farthest = 3;     // usable point, or camera; at least 3
  double nearest = 0.125;  // half of what only 1 of 1,000 sightings is nearer than; at least 0.0025, at most 0.125
};
Reach reach_of(const scene::Scene& scene);

/// Training views that saw each of the points `chosen`: their tracks; for a cloud without tracks those, eight at most,
/// in which the point is not well behind others that are seen in the same direction.
std::vector<std::vector<std::uint32_t>> sightings_of(const scene::Scene& scene,
                                                     const std::vector<std::uint32_t>& chosen);

}  // namespace trisoup::train
