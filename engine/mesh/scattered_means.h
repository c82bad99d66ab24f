// Interpolation of values that are known at scattered points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Means of all values, weighted by the inverse fourth power of their distance (Shepard 1968): near points count most,
/// far ones where there are none nearer. Cells of an octree stand for the points in them where these are far away, so a
/// mean takes some microseconds for millions of points.
class ScatteredMeans {
 public:
  static constexpr int kChannels = 7;
  using Values = std::array<float, kChannels>;
  struct Point {
    glm::vec3 position;
    float weight;
    Values values;
  };

  /// points: at least one, finite, with positive weights. cell: side of the smallest cells, greater than 0; the means
  /// are no sharper. It is enlarged if the points are more than 2^20 such cells across.
  ScatteredMeans(std::span<const Point> points, float cell);

  Values at(const glm::vec3& position) const;

 private:
  struct Node {
    std::uint64_t key;                  // Morton code of the cell
    std::uint32_t first = 0, last = 0;  // its children in the level below
    float weight = 0;
    glm::vec3 moment{0.0f};  // weight times positions
    Values sums{};           // weight times values
  };
  struct Sums {
    double weight = 0;
    std::array<double, kChannels> values{};
  };
  static void add(std::vector<Node>& nodes, const Node& node);
  void sum(std::size_t level, const Node& node, const glm::vec3& position, Sums& sums) const;

  float cell_;
  std::vector<std::vector<Node>> levels_;  // smallest cells first
};

}  // namespace trisoup::soup
