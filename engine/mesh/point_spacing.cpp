#include "mesh/point_spacing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <nanoflann.hpp>

namespace trisoup::soup {
namespace {

// Splits `points` (indices) at the median of their longest axis until each part has at most `largest` points.
void partition(std::span<const glm::vec3> positions, std::span<std::uint32_t> points, std::size_t largest,
               std::vector<std::span<std::uint32_t>>& parts) {
  if (points.size() <= largest) {
    parts.push_back(points);
    return;
  }
  glm::vec3 low(std::numeric_limits<float>::max()), high(-std::numeric_limits<float>::max());
  for (const std::uint32_t k : points) low = glm::min(low, positions[k]), high = glm::max(high, positions[k]);
  const glm::vec3 extent = high - low;
  const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
  const std::size_t half = points.size() / 2;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(half), points.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return positions[a][axis] < positions[b][axis]; });
  partition(positions, points.subspan(0, half), largest, parts);
  partition(positions, points.subspan(half), largest, parts);
}

// A part of the cloud during the farthest-point selection: its bounding box, and its point that is farthest from all
// selected points.
struct Part {
  glm::vec3 low, high;
  float farthest = std::numeric_limits<float>::infinity();  // squared distance; -1 if all are selected
  std::uint32_t farthest_index = 0;                         // original index; the lowest of equally far points
  std::size_t begin = 0, end = 0;
};

struct PointCloud {
  std::span<const glm::vec3> points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::size_t k, std::size_t axis) const { return points[k][static_cast<int>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

double mean(const std::vector<double>& values) {
  return values.empty() ? 0.0 : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::vector<std::uint32_t> farthest_points(std::span<const glm::vec3> points, std::size_t count) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  if (count >= points.size()) count = points.size();
  if (count == 0) return {};

  // With 128 points per part, scanning the parts costs about as much as scanning the points of the parts in reach.
  std::vector<std::span<std::uint32_t>> spans;
  partition(points, order, 128, spans);
  std::vector<Part> parts;
  std::vector<glm::vec3> position(points.size());  // in part order
  // Squared, to the nearest selected point.
  std::vector<float> distance(points.size(), std::numeric_limits<float>::infinity());
  std::size_t at = 0;
  for (const std::span<std::uint32_t> span : spans) {
    std::sort(span.begin(), span.end());  // so that the first maximum of a part has the lowest index
    Part part{points[span[0]], points[span[0]]};
    part.begin = at;
    for (const std::uint32_t k : span) {
      position[at++] = points[k];
      part.low = glm::min(part.low, points[k]), part.high = glm::max(part.high, points[k]);
    }
    part.end = at;
    parts.push_back(part);
  }

  std::vector<std::uint32_t> chosen{0};
  std::uint32_t latest = 0;
  for (;;) {
    const glm::vec3 p = points[latest];
    float farthest = -2;
    std::uint32_t farthest_index = 0;
    for (Part& part : parts) {
      // The distance to the box uses the same operations in the same order as the distance to a point, and each is
      // monotonic. Rounding therefore cannot make it larger than the distance to a point inside the box, so skipping a
      // part never skips a distance that would decrease.
      const glm::vec3 gap = glm::max(glm::max(part.low - p, p - part.high), 0.0f);
      const float nearest = gap.x * gap.x + gap.y * gap.y + gap.z * gap.z;
      if (nearest < part.farthest || (nearest == 0 && part.farthest >= 0)) {
        part.farthest = -1;
        for (std::size_t k = part.begin; k < part.end; ++k) {
          const glm::vec3 d = position[k] - p;
          distance[k] = order[k] == latest ? -1.0f : std::min(distance[k], d.x * d.x + d.y * d.y + d.z * d.z);
          if (distance[k] > part.farthest) part.farthest = distance[k], part.farthest_index = order[k];
        }
      }
      if (part.farthest > farthest || (part.farthest == farthest && part.farthest_index < farthest_index))
        farthest = part.farthest, farthest_index = part.farthest_index;
    }
    if (chosen.size() == count) return chosen;
    latest = farthest_index;
    chosen.push_back(latest);
  }
}

std::vector<double> nearest_distances(std::span<const glm::vec3> points, std::size_t neighbours) {
  std::vector<double> means(points.size(), 0.0);
  neighbours = std::min(neighbours, points.size() - std::min<std::size_t>(1, points.size()));
  if (neighbours == 0) return means;
  const PointCloud cloud{points};
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointCloud>, PointCloud, 3,
                                                   std::uint32_t>;
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  std::vector<std::uint32_t> indices(neighbours + 1);
  std::vector<float> squared(neighbours + 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // The first result is the point itself or a duplicate of it. The remaining results are the distances to other
    // points in both cases.
    tree.knnSearch(&points[i].x, neighbours + 1, indices.data(), squared.data());
    for (std::size_t k = 1; k <= neighbours; ++k) means[i] += std::sqrt(squared[k]);
    means[i] /= static_cast<double>(neighbours);
  }
  return means;
}

double mean_nearest_distance(std::span<const glm::vec3> points) { return mean(nearest_distances(points, 1)); }

}  // namespace trisoup::soup
