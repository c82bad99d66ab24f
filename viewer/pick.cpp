#include "pick.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/host.h"

namespace trisoup::viewer {
namespace {

/// Opacity, 0 to 255, of a triangle at a point with the barycentrics b0 and b1.
double opacity_at(const soup::Model& model, std::size_t triangle, double b0, double b1) {
  const soup::TextureEntry& texture = model.textures[triangle];
  const f64::LatticeCell cell = f64::lattice_cell(b0, b1, texture.level_max);
  const auto sample = [&](std::uint32_t i) {
    return double(model.lattice[(std::size_t(texture.lattice_offset) + i) * soup::kChannels + soup::kChannels - 1]);
  };
  return cell.w0 * sample(cell.i0) + cell.w1 * sample(cell.i1) + cell.w2 * sample(cell.i2);
}

}  // namespace

std::optional<glm::dvec3> surface_point(const soup::Model& model, const scene::Camera& camera, const glm::dvec2& pixel,
                                        double near, double far, bool drop_behind) {
  // The ray has depth 1 per unit, so the parameter of a point is its depth.
  const glm::dvec3 eye = camera.centre();
  const glm::dvec3 in_camera((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy, 1.0);
  const glm::dvec3 ray = glm::transpose(glm::dmat3(camera.world_to_camera)) * in_camera, ahead = camera.forward();
  const std::vector<glm::vec3> vertices = soup::normalised_vertices(model);
  double nearest = far;
  bool hit = false;
  for (std::size_t t = 0; t < model.triangles(); ++t) {
    // Intersection of Möller and Trumbore (1997).
    const glm::dvec3 v2 = vertices[3 * t + 2], e0 = glm::dvec3(vertices[3 * t]) - v2,
                     e1 = glm::dvec3(vertices[3 * t + 1]) - v2, from = eye - v2;
    const glm::dvec3 p = glm::cross(ray, e1), q = glm::cross(from, e0);
    const double determinant = glm::dot(e0, p);
    const double b0 = glm::dot(from, p) / determinant, b1 = glm::dot(ray, q) / determinant;
    const double depth = glm::dot(e1, q) / determinant;
    // Written so that a determinant of 0 fails.
    if (!(b0 >= 0 && b1 >= 0 && b0 + b1 <= 1 && depth >= near && depth < nearest)) continue;
    if (drop_behind && glm::dot(ahead, v2 - eye) + std::min({0.0, glm::dot(ahead, e0), glm::dot(ahead, e1)}) <= 0)
      continue;
    if (opacity_at(model, t, b0, b1) < 127.5) continue;
    nearest = depth;
    hit = true;
  }
  if (!hit) return std::nullopt;
  return eye + nearest * ray;
}

}  // namespace trisoup::viewer
