// Tests viewer/pick.h.
#include <catch2/catch.hpp>

#include "render/cameras.h"
#include "viewer/pick.h"

using namespace trisoup;

namespace {

/// Triangles parallel to the picture of a camera at the origin that looks along +X: one at x = 2 in front of one at
/// x = 3. Textures of level 0, opaque.
soup::Model two_triangles() {
  soup::Model model;
  for (const float x : {2.0f, 3.0f}) {
    for (const glm::vec2 corner : {glm::vec2(-1, -1), glm::vec2(3, -1), glm::vec2(-1, 3)})
      model.vertices.emplace_back(x, corner.x, corner.y);
    model.textures.push_back({0, static_cast<std::uint32_t>(model.lattice.size() / soup::kChannels), 0, 0});
    model.lattice.resize(model.lattice.size() + 3 * soup::kChannels, 255);
  }
  return model;
}

void set_opacity(soup::Model& model, std::size_t triangle, std::size_t corner, std::uint8_t opacity) {
  model.lattice[(model.textures[triangle].lattice_offset + corner) * soup::kChannels + 7] = opacity;
}

const scene::Camera kCamera = render::look_at({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.9, 200, 100);

std::optional<glm::dvec3> at(const soup::Model& model, double x, double y, double near = 0.01, double far = 10,
                             bool drop = false) {
  return viewer::surface_point(model, kCamera, {x, y}, near, far, drop);
}

}  // namespace

TEST_CASE("the nearest surface under a pixel is found", "[pick]") {
  const soup::Model model = two_triangles();
  const auto middle = at(model, 100, 50);
  REQUIRE(middle);
  CHECK(glm::length(*middle - glm::dvec3(2, 0, 0)) < 1e-6);
  // Camera: x to the right is -y, y down is -z.
  const auto right = at(model, 140, 30);
  REQUIRE(right);
  CHECK(right->x == Approx(2));
  CHECK(right->y == Approx(-2 * 40 / kCamera.fx));
  CHECK(right->z == Approx(2 * 20 / kCamera.fy));
  CHECK(!at(model, 199, 50));
  CHECK(!at(soup::Model(), 100, 50));
}

TEST_CASE("clip planes and transparent parts let the next surface through", "[pick]") {
  soup::Model model = two_triangles();
  CHECK(at(model, 100, 50, 2.5)->x == Approx(3));
  CHECK(!at(model, 100, 50, 3.5));
  CHECK(!at(model, 100, 50, 0.01, 1.5));
  // The pixel is at barycentrics 1/2, 1/4, 1/4 of the corners (-1, -1), (3, -1) and (-1, 3).
  for (std::size_t corner = 0; corner < 3; ++corner) set_opacity(model, 0, corner, 127);
  CHECK(at(model, 100, 50)->x == Approx(3));
  for (std::size_t corner = 0; corner < 3; ++corner) set_opacity(model, 0, corner, 128);
  CHECK(at(model, 100, 50)->x == Approx(2));
}

TEST_CASE("triangles that reach behind the camera count unless they are dropped", "[pick]") {
  soup::Model model = two_triangles();
  model.vertices[2] = {-1, -1, 3};
  const auto clipped = at(model, 100, 50);
  REQUIRE(clipped);
  CHECK(clipped->x < 2.5);
  CHECK(at(model, 100, 50, 0.01, 10, true)->x == Approx(3));
}

TEST_CASE("picking uses normalised coordinates", "[pick]") {
  soup::Model model = two_triangles();
  model.origin = {10, 20, 30};
  model.centre = {10, 20, 30};
  model.scale = 2;
  CHECK(at(model, 100, 50)->x == Approx(4));
}
