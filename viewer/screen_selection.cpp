#include "screen_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "mesh/triangle_distance.h"

namespace trisoup::viewer {
namespace {

double distance_to(const BrushMove& brush, const glm::dvec2& p) {
  const glm::dvec2 along = brush.to - brush.from;
  const double length2 = glm::dot(along, along);
  const double part = length2 > 0 ? std::clamp(glm::dot(p - brush.from, along) / length2, 0.0, 1.0) : 0.0;
  return glm::distance(p, brush.from + part * along);
}

bool inside(std::span<const glm::dvec2> outline, const glm::dvec2& p) {
  bool odd = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const glm::dvec2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
    if ((a.y > p.y) == (b.y > p.y)) continue;
    if (p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) odd = !odd;
  }
  return odd;
}

/// Pixels whose centres lie in a box, clipped to the picture. Empty if first > last.
struct PixelRange {
  long left, right, top, bottom;
};
PixelRange pixels_in(const TrianglePicture& picture, const glm::dvec2& low, const glm::dvec2& high) {
  const auto first = [](double edge, std::uint32_t size) {
    return static_cast<long>(std::clamp(std::floor(edge), 0.0, double(size)));
  };
  const auto last = [](double edge, std::uint32_t size) {
    return static_cast<long>(std::clamp(std::ceil(edge), -1.0, double(size) - 1));
  };
  return {first(low.x, picture.width), last(high.x, picture.width), first(low.y, picture.height),
          last(high.y, picture.height)};
}

/// Calls each(hit, centre) for the pixels of the box that show a triangle.
template <typename Each>
void each_hit(const TrianglePicture& picture, const glm::dvec2& low, const glm::dvec2& high, Each&& each) {
  const PixelRange range = pixels_in(picture, low, high);
  for (long y = range.top; y <= range.bottom; ++y)
    for (long x = range.left; x <= range.right; ++x)
      if (const std::uint32_t hit = picture.hits[static_cast<std::size_t>(y) * picture.width + x])
        each(hit, glm::dvec2(double(x) + 0.5, double(y) + 0.5));
}

/// Where a camera shows a point of its own coordinates, also outside of its image.
glm::dvec2 projected(const scene::Camera& camera, const glm::dvec3& p) {
  return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
}

/// Returns the picture of a triangle's part at depths of at least `near`: a convex polygon, or nothing. corners: in the
/// camera's coordinates.
std::vector<glm::dvec2> outline_of(const scene::Camera& camera, double near, const std::array<glm::dvec3, 3>& corners) {
  std::vector<glm::dvec2> outline;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 &a = corners[i], &b = corners[(i + 1) % 3];
    if (a.z >= near) outline.push_back(projected(camera, a));
    if ((a.z >= near) != (b.z >= near)) {
      glm::dvec3 border = a + (b - a) * ((near - a.z) / (b.z - a.z));
      border.z = near;
      outline.push_back(projected(camera, border));
    }
  }
  return outline;
}

/// Calls each(triangle, corners in the camera's coordinates).
template <typename Each>
void each_triangle(const soup::Model& model, const scene::Camera& camera, Each&& each) {
  const std::vector<glm::vec3> vertices = soup::normalised_vertices(model);
  for (std::uint32_t t = 0; t < model.triangles(); ++t) {
    std::array<glm::dvec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = glm::dvec3(camera.world_to_camera * glm::dvec4(vertices[3 * std::size_t(t) + k], 1.0));
    each(t, corners);
  }
}

bool touches(const BrushMove& brush, const std::vector<glm::dvec2>& outline) {
  if (outline.size() < 3) return false;
  glm::dvec2 low = outline[0], high = outline[0];
  for (const glm::dvec2& p : outline) low = glm::min(low, p), high = glm::max(high, p);
  // Most triangles are far from the brush.
  if (glm::any(glm::greaterThan(low, glm::max(brush.from, brush.to) + brush.radius)) ||
      glm::any(glm::lessThan(high, glm::min(brush.from, brush.to) - brush.radius)))
    return false;
  const soup::Corners3 line{glm::dvec3(brush.from, 0), glm::dvec3(brush.to, 0), glm::dvec3(brush.to, 0)};
  for (std::size_t i = 2; i < outline.size(); ++i)
    if (soup::distance({glm::dvec3(outline[0], 0), glm::dvec3(outline[i - 1], 0), glm::dvec3(outline[i], 0)}, line) <=
        brush.radius)
      return true;
  return false;
}

}  // namespace

std::uint32_t hit_at(const TrianglePicture& picture, const glm::dvec2& at) {
  if (!(at.x >= 0 && at.y >= 0 && at.x < picture.width && at.y < picture.height)) return 0;
  return picture.hits[static_cast<std::size_t>(at.y) * picture.width + static_cast<std::size_t>(at.x)];
}

std::vector<std::uint32_t> visible_under(const TrianglePicture& picture, const BrushMove& brush) {
  std::vector<std::uint32_t> triangles;
  const glm::dvec2 low = glm::min(brush.from, brush.to) - brush.radius,
                   high = glm::max(brush.from, brush.to) + brush.radius;
  each_hit(picture, low, high, [&](std::uint32_t hit, const glm::dvec2& centre) {
    if (distance_to(brush, centre) <= brush.radius) triangles.push_back(hit - 1);
  });
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::vector<std::uint32_t> visible_inside(const TrianglePicture& picture, std::span<const glm::dvec2> outline) {
  if (outline.size() < 3) return {};
  std::uint32_t most = 0;
  for (const std::uint32_t hit : picture.hits) most = std::max(most, hit);
  std::vector<std::uint32_t> pixels(most + std::size_t{1}), within(pixels.size());
  glm::dvec2 low = outline[0], high = outline[0];
  for (const glm::dvec2& p : outline) low = glm::min(low, p), high = glm::max(high, p);
  for (const std::uint32_t hit : picture.hits) ++pixels[hit];
  each_hit(picture, low, high, [&](std::uint32_t hit, const glm::dvec2& centre) {
    if (inside(outline, centre)) ++within[hit];
  });
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t t = 0; t < most; ++t)
    if (within[t + 1] > 0 && 2 * std::uint64_t{within[t + 1]} >= pixels[t + 1]) triangles.push_back(t);
  return triangles;
}

std::vector<std::uint32_t> all_under(const soup::Model& model, const scene::Camera& camera, double near,
                                     const BrushMove& brush) {
  std::vector<std::uint32_t> triangles;
  each_triangle(model, camera, [&](std::uint32_t t, const std::array<glm::dvec3, 3>& corners) {
    if (touches(brush, outline_of(camera, near, corners))) triangles.push_back(t);
  });
  return triangles;
}

std::vector<std::uint32_t> all_inside(const soup::Model& model, const scene::Camera& camera, double near,
                                      std::span<const glm::dvec2> outline) {
  std::vector<std::uint32_t> triangles;
  each_triangle(model, camera, [&](std::uint32_t t, const std::array<glm::dvec3, 3>& corners) {
    const glm::dvec3 centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
    if (centroid.z >= near && inside(outline, projected(camera, centroid))) triangles.push_back(t);
  });
  return triangles;
}

}  // namespace trisoup::viewer
