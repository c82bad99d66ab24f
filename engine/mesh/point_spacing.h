// How points of a cloud are spaced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// `count` points spread as far from each other as can be: the first is point 0, each next one is the farthest from all
/// before it, of equals the one of lowest index (Gonzalez 1985). Indices in the order of choice, no point twice; all of
/// them if there are fewer. Points must be finite. Exact; a k-d partition spares most distances: 10,000 of a million
/// points take about a second.
std::vector<std::uint32_t> farthest_points(std::span<const glm::vec3> points, std::size_t count);

/// For every point the mean distance to its nearest `neighbours` other points, fewer where there are fewer.
std::vector<double> nearest_distances(std::span<const glm::vec3> points, std::size_t neighbours);

/// Mean over the points of the distance to the nearest other point, 0 for each point that has a duplicate. 0 below two
/// points.
double mean_nearest_distance(std::span<const glm::vec3> points);

}  // namespace trisoup::soup
