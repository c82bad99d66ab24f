// Planes in a sparse point cloud that may be the ground.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::scene {

struct GroundPlane {
  glm::dvec3 normal{0.0};  // unit length, on the side of the cameras
  double offset = 0;       // points of the plane have dot(normal, p) = offset
  double share = 0;        // share of the points near the cameras that lie on it, 0 to 1
};

/// Returns up to three planes with nearly all cameras on one side, those with the most points first. RANSAC (Fischler
/// and Bolles, 1981) with a fixed seed, so the result depends on the arguments only.
/// points, centres of cameras: normalised coordinates. Empty if there are fewer than 50 points near the cameras.
std::vector<GroundPlane> ground_planes(std::span<const glm::vec3> points, std::span<const glm::dvec3> centres);

}  // namespace trisoup::scene
