#include "scene/lens/panorama.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/lens/sample.h"

namespace trisoup::scene {

Camera panorama_camera(int width, int height) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.fx = 0.5 * width / std::numbers::pi, camera.fy = height / std::numbers::pi;
  camera.cx = 0.5 * width, camera.cy = 0.5 * height;
  return camera;
}

bool is_whole_panorama(int width, int height) { return std::abs(0.5 * width / height - 1) < 0.02; }

const std::array<CubeFace, 6>& cube_faces() {
  // The columns are the face's axes (right, down, forward) in the panorama's axes. The horizon of the four faces around
  // stays horizontal; the tops of down and up point forward and backward.
  const auto axes = [](glm::dvec3 right, glm::dvec3 down, glm::dvec3 forward) {
    return glm::dmat3(right, down, forward);
  };
  static const std::array<CubeFace, 6> faces{{{"back", axes({-1, 0, 0}, {0, 1, 0}, {0, 0, -1})},
                                              {"down", axes({1, 0, 0}, {0, 0, -1}, {0, 1, 0})},
                                              {"front", axes({1, 0, 0}, {0, 1, 0}, {0, 0, 1})},
                                              {"left", axes({0, 0, 1}, {0, 1, 0}, {-1, 0, 0})},
                                              {"right", axes({0, 0, -1}, {0, 1, 0}, {1, 0, 0})},
                                              {"up", axes({1, 0, 0}, {0, 0, 1}, {0, -1, 0})}}};
  return faces;
}

std::size_t face_towards(glm::dvec3 direction) {
  const auto& faces = cube_faces();
  const auto along = [&](const CubeFace& face) { return glm::dot(face.panorama_from_face[2], direction); };
  return static_cast<std::size_t>(
      std::max_element(faces.begin(), faces.end(),
                       [&](const CubeFace& a, const CubeFace& b) { return along(a) < along(b); }) -
      faces.begin());
}

int face_side(int width) { return std::max(1, static_cast<int>(std::lround(0.25 * width))); }

Camera face_camera(const Camera& panorama, std::size_t face) {
  Camera camera;
  camera.width = camera.height = face_side(panorama.width);
  camera.fx = camera.fy = camera.cx = camera.cy = 0.5 * camera.width;
  const glm::dmat3 face_from_panorama = glm::transpose(cube_faces()[face].panorama_from_face);
  camera.world_to_camera = glm::dmat4(face_from_panorama) * panorama.world_to_camera;
  return camera;
}

Photograph cut_face(const Photograph& photograph, const Camera& panorama, std::size_t face) {
  const glm::dmat3& panorama_from_face = cube_faces()[face].panorama_from_face;
  const int side = face_side(photograph.width);
  return resample(photograph, side, side, Border::wrapped, [&](int x, int y) {
    const glm::dvec3 ray(2 * (x + 0.5) / side - 1, 2 * (y + 0.5) / side - 1, 1);
    const glm::dvec3 d = panorama_from_face * ray;
    const double longitude = std::atan2(d.x, d.z), latitude = std::atan2(d.y, std::hypot(d.x, d.z));
    return std::optional(glm::dvec2(panorama.cx + panorama.fx * longitude, panorama.cy + panorama.fy * latitude));
  });
}

}  // namespace trisoup::scene
