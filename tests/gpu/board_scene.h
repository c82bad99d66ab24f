// Views of a slanted floor and a board, whose depths are known.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "scene/scene.h"
#include "speckle.h"

namespace trisoup::test {

inline constexpr int kBoardWidth = 96, kBoardHeight = 64;

/// Depth along z from a camera at `eye` that looks along z: a floor that rises to the right, 0.35 per unit, and a board
/// in front of its left part.
inline double true_depth(const glm::dvec3& eye, const glm::dvec3& ray) {
  const double board = 0.4 - eye.z;
  if (eye.x + board * ray.x < -0.25) return board;
  return (1.6 - eye.z - 0.35 * eye.x) / (1 + 0.35 * ray.x);
}

inline glm::dvec3 eye_of(int view) { return {0.16 * (view % 3) - 0.16, 0.16 * (view / 3) - 0.08, -1}; }

inline glm::dvec3 ray_of(const scene::Camera& c, int x, int y) {
  return {(x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1};
}

inline std::vector<scene::View> photographs(int count) {
  std::vector<scene::View> views;
  for (int k = 0; k < count; ++k) {
    scene::View& v = views.emplace_back();
    scene::Camera& c = v.camera;
    c.width = kBoardWidth, c.height = kBoardHeight, c.fx = c.fy = 90, c.cx = 47, c.cy = 33;
    c.world_to_camera[3] = glm::dvec4(-eye_of(k), 1);
    v.image = {kBoardWidth, kBoardHeight, {}};
    for (int y = 0; y < kBoardHeight; ++y)
      for (int x = 0; x < kBoardWidth; ++x) {
        const glm::dvec3 ray = ray_of(c, x, y), p = eye_of(k) + true_depth(eye_of(k), ray) * ray;
        const auto grey = static_cast<std::uint8_t>(speckle(14 * p.x + 3 * p.z, 14 * p.y));
        v.image.rgba.insert(v.image.rgba.end(), {grey, grey, grey, 255});
      }
  }
  return views;
}

}  // namespace trisoup::test
