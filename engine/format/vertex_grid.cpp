#include "format/vertex_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/error.h"

namespace trisoup::soup {
namespace {

/// Depths below this are clamped, so that near objects do not need finer grids. Normalised units.
constexpr double kNearest = 0.025;

struct CornersInSpace {
  glm::dvec3 at[3];
};

double focal(const scene::Camera& camera) { return std::max(camera.fx, camera.fy); }

/// Returns the size of a pixel at the triangle's nearest corner, or INFINITY if the camera does not show it.
double shown_pixel(const scene::Camera& camera, const CornersInSpace& corners) {
  double nearest = INFINITY;
  glm::dvec2 low(INFINITY), high(-INFINITY);
  for (const glm::dvec3& corner : corners.at) {
    const glm::dvec3 p = camera.world_to_camera * glm::dvec4(corner, 1);
    nearest = std::min(nearest, p.z);
    const glm::dvec2 pixel(camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
    low = glm::min(low, pixel);
    high = glm::max(high, pixel);
  }
  // A triangle that reaches behind the camera is much larger than its pixels, so it is not used.
  const bool shown = nearest >= kNearest && low.x < camera.width && low.y < camera.height && high.x > 0 && high.y > 0;
  return shown ? nearest / focal(camera) : INFINITY;
}

/// Pixel size at the nearest camera, for triangles that no camera shows.
double nearest_pixel(std::span<const ModelCamera> cameras, const CornersInSpace& corners) {
  double min_size = INFINITY;
  for (const ModelCamera& c : cameras)
    for (const glm::dvec3& corner : corners.at)
      min_size = std::min(min_size, std::max(kNearest, glm::distance(corner, c.camera.centre())) / focal(c.camera));
  return min_size;
}

int exponent_for(std::span<const ModelCamera> cameras, const CornersInSpace& corners, double share) {
  double pixel = INFINITY, largest = 0;
  for (const ModelCamera& c : cameras) pixel = std::min(pixel, shown_pixel(c.camera, corners));
  if (!std::isfinite(pixel)) pixel = nearest_pixel(cameras, corners);
  for (const glm::dvec3& corner : corners.at)
    largest = std::max({largest, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
  const double wanted = std::ceil(-std::log2(share * pixel));
  const double max_exponent = largest > 0 ? std::floor(std::log2(double(kMostSteps) / largest)) : double(kMostExponent);
  return static_cast<int>(std::clamp(std::min(wanted, max_exponent), -double(kMostExponent), double(kMostExponent)));
}

/// Returns the rank of each value in sorted order.
std::vector<std::uint32_t> ranks(const std::vector<double>& values) {
  std::vector<std::uint32_t> order(values.size()), rank(values.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return values[a] < values[b]; });
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  return rank;
}

}  // namespace

std::vector<GridTriangle> on_grid(const Model& model, std::span<const ModelCamera> cameras, double share) {
  const std::vector<glm::vec3> vertices = normalised_vertices(model);
  std::vector<GridTriangle> triangles(model.triangles());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    CornersInSpace corners;
    for (std::size_t k = 0; k < 3; ++k) corners.at[k] = glm::dvec3(vertices[3 * t + k]);
    triangles[t].exponent = exponent_for(cameras, corners, share);
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 steps = glm::round(corners.at[k] * std::ldexp(1.0, triangles[t].exponent));
      if (!glm::all(glm::lessThanEqual(glm::abs(steps), glm::dvec3(kMostSteps))))
        throw Error("model: triangle {} is too far away for a grid; set `vertex_share` to 0 to store exact vertices",
                    t);
      triangles[t].corners[k] = glm::ivec3(steps);
    }
  }
  return triangles;
}

std::vector<glm::vec3> from_grid(std::span<const GridTriangle> triangles, const Model& model) {
  const glm::dvec3 middle = model.centre - model.origin;
  std::vector<glm::vec3> vertices;
  vertices.reserve(3 * triangles.size());
  for (const GridTriangle& triangle : triangles)
    for (const glm::ivec3& corner : triangle.corners)
      vertices.emplace_back(glm::dvec3(corner) * std::ldexp(1.0, -triangle.exponent) / model.scale + middle);
  return vertices;
}

Model along_curve(const Model& model) {
  std::vector<double> middles[3];
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t t = 0; t < model.triangles(); ++t)
      middles[axis].push_back(double(model.vertices[3 * t][axis]) + model.vertices[3 * t + 1][axis] +
                              model.vertices[3 * t + 2][axis]);
  const std::vector<std::uint32_t> rank[3] = {ranks(middles[0]), ranks(middles[1]), ranks(middles[2])};
  std::vector<std::pair<std::uint64_t, std::uint32_t>> curve;
  const int bits = std::min(21, static_cast<int>(std::bit_width(model.triangles())));
  for (std::uint32_t t = 0; t < model.triangles(); ++t) {
    std::uint64_t place = 0;
    for (int bit = bits - 1; bit >= 0; --bit)
      for (const auto& axis : rank) place = place << 1 | (axis[t] >> bit & 1);
    curve.emplace_back(place, t);
  }
  std::sort(curve.begin(), curve.end());
  Model sorted = model;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const std::size_t t = curve[i].second;
    sorted.textures[i] = model.textures[t];
    for (std::size_t k = 0; k < 3; ++k) sorted.vertices[3 * i + k] = model.vertices[3 * t + k];
  }
  return sorted;
}

}  // namespace trisoup::soup
