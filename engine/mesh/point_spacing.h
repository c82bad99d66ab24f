// Farthest-point sampling and nearest-neighbour distances of point clouds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Farthest-point sampling (Gonzalez 1985): starts with point 0 and repeatedly adds the point farthest from all
/// selected ones, the lowest index among equals. Returns `count` distinct indices in order of selection, or all indices
/// if there are fewer points. Points must be finite. The result is exact. A k-d partition avoids most distance
/// computations: selecting 10,000 of a million points takes about a second.
std::vector<std::uint32_t> farthest_points(std::span<const glm::vec3> points, std::size_t count);

/// Returns for each point the mean distance to its `neighbours` nearest other points, or to all if there are fewer.
std::vector<double> nearest_distances(std::span<const glm::vec3> points, std::size_t neighbours);

/// Returns the mean over all points of the distance to the nearest other point. A point with a duplicate counts as 0.
/// Returns 0 for fewer than two points.
double mean_nearest_distance(std::span<const glm::vec3> points);

}  // namespace trisoup::soup
