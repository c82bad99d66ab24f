// Reference picture: the nearest opaque triangle of every pixel in double precision, with a mark for pixels where
// rounding decides.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/host.h"
#include "gpu/small_scene.h"

namespace trisoup::test {

struct ReferencePixel {
  std::uint32_t triangle = 0;  // index + 1; 0: none
  bool tie = false;            // another result within a twentieth of a pixel or 1e-5 of depth
};

/// Covered in front of the camera, with depth in -1..1; among equal depths the lower index.
inline std::vector<ReferencePixel> reference_picture(std::span<const glm::vec3> vertices,
                                                     const train::BatchView& view) {
  const std::size_t triangles = vertices.size() / 3;
  std::vector<glm::dvec4> clip;
  for (const glm::vec3& v : vertices) clip.push_back(view.clip_from_world * glm::dvec4(glm::dvec3(v), 1));
  const auto winner = [&](glm::dvec2 ndc, double& depth, double& second) {
    std::uint32_t best = 0;
    depth = second = 1;
    for (std::size_t t = 0; t < triangles; ++t) {
      const f64::PlanePoint p = f64::plane_point(clip[3 * t], clip[3 * t + 1], clip[3 * t + 2], ndc);
      if (!p.inside || !(p.depth > -1) || !(p.depth < 1)) continue;
      if (p.depth < depth) {
        second = depth;
        depth = p.depth;
        best = static_cast<std::uint32_t>(t) + 1;
      } else if (p.depth > depth) {  // exactly equal depths are not a tie: the order decides
        second = std::min(second, p.depth);
      }
    }
    return best;
  };
  std::vector<ReferencePixel> picture;
  for (std::uint32_t y = 0; y < view.height; ++y)
    for (std::uint32_t x = 0; x < view.width; ++x) {
      const glm::dvec2 ndc = f64::pixel_ndc(x, y, view.width, view.height);
      double depth, second, ignored;
      ReferencePixel seen{winner(ndc, depth, second), false};
      seen.tie = seen.triangle != 0 && second - depth < 1e-5;
      for (const glm::dvec2& to :
           {glm::dvec2(1, 0), {-1, 0}, {0, 1}, {0, -1}, {0.7, 0.7}, {-0.7, 0.7}, {0.7, -0.7}, {-0.7, -0.7}})
        seen.tie =
            seen.tie || winner(ndc + 0.1 * to / glm::dvec2(view.width, view.height), ignored, ignored) != seen.triangle;
      picture.push_back(seen);
    }
  return picture;
}

/// Whether a triangle covers a point within one and a half pixels of a pixel's centre.
inline bool near_by(std::span<const glm::vec3> vertices, const train::BatchView& view, std::uint32_t triangle,
                    std::uint32_t x, std::uint32_t y) {
  glm::dvec4 clip[3];
  for (int k = 0; k < 3; ++k) clip[k] = view.clip_from_world * glm::dvec4(glm::dvec3(vertices[3 * triangle + k]), 1);
  const glm::dvec2 size(view.width, view.height), centre = f64::pixel_ndc(x, y, view.width, view.height);
  for (int j = -6; j <= 6; ++j)
    for (int i = -6; i <= 6; ++i)
      if (f64::plane_point(clip[0], clip[1], clip[2], centre + 0.5 * glm::dvec2(i, j) / size).inside) return true;
  return false;
}

}  // namespace trisoup::test
