// Filters the sparse point cloud for a surface start.
#pragma once

#include <cstddef>
#include <span>

#include "scene/scene.h"

namespace trisoup::train {

/// Indices of the reliable points of the cloud and of all distant ones, ascending. Drops points
/// - beyond three times the 99th percentile of distances: mismatches near the horizon of a view;
/// - with a reprojection error, if known, above both 2 pixels and twice the median;
/// - seen by fewer than three views (two in a cloud of stereo, one if measured) or, in a cloud without tracks, the 3 %
///   farthest from their eight nearest neighbours in contracted() space.
/// A rule that would leave less than a third of the cloud is skipped, because such a cloud is sparse rather than bad.
std::vector<std::uint32_t> usable_points(const scene::Points& points);

/// Points of which each stands for those of its cell.
struct Thinned {
  std::vector<std::uint32_t> chosen;              // ascending
  std::vector<std::vector<std::uint32_t>> cells;  // [chosen] the points of its cell, itself among them
};
/// Keeps at most `max_points` of the cloud's points, and all distant ones: the one seen by the most views in each cell
/// of a grid in contracted space. usable: ascending.
Thinned thinned(const scene::Points& points, const std::vector<std::uint32_t>& usable, std::size_t max_points);

/// Points far behind most others, drawn nearer: a distance r from the origin becomes R (1 + log(r / R)) beyond R, which
/// is 8 to 64 times that of the farthest camera, or of 1. Qhull would have to jitter all points by more than their
/// distances where some are hundreds of times as far as others, even if these are many, as those of a measured sky.
/// That far out the lines of sight of all cameras are nearly radial, so what is in front of what stays as it is.
/// cameras: positions.
std::vector<glm::dvec3> drawn_in(std::span<const glm::dvec3> points, std::span<const glm::dvec3> cameras);

/// Contracts space as in Mip-NeRF 360 (Barron et al. 2022): points within distance 1 of the origin stay, others move to
/// distance 2 - 1 / distance. Far away, equal lengths there are roughly equal angles seen from the cameras.
glm::dvec3 contracted(const glm::dvec3& p);

/// Extent of the scene and distance of the nearest geometry to a camera, normalised units.
struct Reach {
  double farthest = 3;     // distance of the farthest usable point or camera from the origin; at least 3
  double nearest = 0.125;  // half the depth below which 1 in 1,000 sightings is; 0.0025..0.125
};
Reach reach_of(const scene::Scene& scene);

/// The training views that saw each of the points `chosen`, from their tracks. For a cloud without tracks, up to eight
/// nearest views in which no other points in about the same direction are clearly in front. [chosen]
std::vector<std::vector<std::uint32_t>> sightings_of(const scene::Scene& scene,
                                                     const std::vector<std::uint32_t>& chosen);

/// Sightings of points that stand for others: the views that saw any of a cell. A stray point is alone in its cell, so
/// that a surface's many outweigh it. Without tracks, those of sightings_of().
struct MergedSightings {
  std::vector<std::vector<std::uint32_t>> seen_by;  // [chosen] ascending
  /// As seen_by: how many of the cell's points the view saw, as a share of the mean number of points in a cell; at
  /// least 1, because a place that few pixels show is seen all the same.
  std::vector<std::vector<float>> weights;
};
MergedSightings merged_sightings(const scene::Scene& scene, const Thinned& thinned);

}  // namespace trisoup::train
