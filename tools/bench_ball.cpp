#include "bench_ball.h"

#include <cmath>

#include <glm/glm.hpp>

#include "train/start/random_start.h"

namespace trisoup::bench {

std::vector<scene::Camera> cameras_around(std::uint32_t views, std::uint32_t side) {
  std::vector<scene::Camera> cameras;
  for (std::uint32_t i = 0; i < views; ++i) {
    scene::Camera camera;
    camera.width = camera.height = static_cast<int>(side);
    camera.fx = camera.fy = 1.4 * side;
    camera.cx = camera.cy = 0.5 * side;
    const double angle = 1.5707963 * i;
    const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
    glm::dmat4 world_from_camera(1.0);
    world_from_camera[0] = glm::dvec4(x, 0);
    world_from_camera[1] = glm::dvec4(y, 0);
    world_from_camera[2] = glm::dvec4(z, 0);
    world_from_camera[3] = glm::dvec4(-z, 1);
    camera.world_to_camera = glm::inverse(world_from_camera);
    cameras.push_back(camera);
  }
  return cameras;
}

void load_ball(gpu::Device& gpu, train::SoupBuffers& soup, std::uint32_t triangles, soup::TextureLevels levels) {
  const glm::vec3 half(0.25f);
  const auto vertices = soup::triangles_in_box(triangles, -half, half, 0.25 * std::sqrt(16.0 / triangles), 1);
  train::allocate_soup(gpu, soup, vertices, soup::make_texture_table(triangles, levels).entries);
  train::allocate_mlp(gpu, soup, train::initial_mlp(1));
}

}  // namespace trisoup::bench
