#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

#include "scene/stereo/neighbours.h"

using namespace trisoup;

namespace {

/// A view at `eye` that looks at `target`, 90 degrees wide.
scene::View looking_at(const glm::dvec3& eye, const glm::dvec3& target) {
  scene::View view;
  scene::Camera& c = view.camera;
  c.width = c.height = 100, c.fx = c.fy = 50, c.cx = c.cy = 50;
  const glm::dvec3 z = glm::normalize(target - eye), x = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), z)),
                   y = glm::cross(z, x);
  const glm::dmat3 rotation = glm::transpose(glm::dmat3(x, y, z));
  c.world_to_camera = glm::dmat4(rotation);
  c.world_to_camera[3] = glm::dvec4(-(rotation * eye), 1);
  return view;
}

/// The neighbours of the first of three views of a place at distance 3.
std::vector<std::uint32_t> neighbours_of_first(const scene::View& second, const scene::View& third) {
  const std::vector<scene::View> views{looking_at({0, 0, 0}, {0, 0, 3}), second, third};
  const std::vector<scene::Probes> probes(3, {{0, 0, 3}, {0.2, 0, 3}, {0, 0.2, 3.1}, {-0.2, -0.2, 3}});
  return scene::stereo_neighbours(views, probes, std::vector<std::uint32_t>{0, 1, 2}, 8)[0];
}

}  // namespace

TEST_CASE("someone who walks past a place finds neighbours for its photographs", "[stereo]") {
  const auto aside = [](double degrees) {
    const double a = degrees * 3.14159265358979 / 180;
    return looking_at({3 * std::sin(a), 0, 3 - 3 * std::cos(a)}, {0, 0, 3});
  };
  const auto ahead = [](double distance) { return looking_at({0.3, 0, 3 - distance}, {0, 0, 3}); };
  CHECK(neighbours_of_first(aside(65), aside(85)) == std::vector<std::uint32_t>{1});
  CHECK(neighbours_of_first(ahead(1.3), ahead(0.7)) == std::vector<std::uint32_t>{1});
  CHECK(neighbours_of_first(aside(65), aside(45)) == std::vector<std::uint32_t>{2, 1});
}
