// Tests viewer/frustums.h.
#include <catch2/catch.hpp>

#include "render/cameras.h"
#include "viewer/frustums.h"

using namespace trisoup;
using namespace trisoup::viewer;

namespace {

const scene::Camera kViewer = render::look_at({0, -5, 0}, {0, 0, 0}, {0, 0, 1}, 0.9, 200, 100);

soup::ModelCamera camera_at(const glm::dvec3& eye, const glm::dvec3& target) {
  return {"", false, render::look_at(eye, target, {0, 0, 1}, 0.9, 60, 40)};
}

glm::dvec2 pixel_of(const glm::dvec3& point) {
  const auto shown = scene::shown_at(kViewer, point);
  REQUIRE(shown);
  return shown->pixel;
}

}  // namespace

TEST_CASE("a pyramid has its tip at the eye and its picture in front of it", "[frustums]") {
  const scene::Camera c = camera_at({0, 0, 0}, {1, 0, 0}).camera;
  const std::vector<Line> lines = frustum_lines(c, 0.5, kViewer);
  REQUIRE(lines.size() == 8);
  const glm::dvec2 tip = pixel_of({0, 0, 0});
  for (int i = 0; i < 4; ++i) CHECK(glm::length(lines[i][0] - tip) < 1e-9);
  // The top left corner of its picture: x right is -y, y down is -z.
  const glm::dvec2 corner = pixel_of({0.5, 0.5 * 30 / c.fx, 0.5 * 20 / c.fy});
  CHECK(glm::length(lines[0][1] - corner) < 1e-9);
}

TEST_CASE("pyramids behind the viewer are not drawn, and those beside it are cut", "[frustums]") {
  CHECK(frustum_lines(camera_at({0, -8, 0}, {0, -9, 0}).camera, 0.5, kViewer).empty());
  // The eye is behind the viewer, the picture in front of it.
  const std::vector<Line> cut = frustum_lines(camera_at({0.2, -5.6, 0.3}, {0.2, 0, 0.3}).camera, 1.0, kViewer);
  CHECK(cut.empty());  // closer than its length
  const std::vector<Line> lines = frustum_lines(camera_at({1, -5.6, 1}, {1, 0, 1}).camera, 1.0, kViewer);
  REQUIRE(lines.size() == 8);
  for (const Line& line : lines)
    for (const glm::dvec2& end : line) CHECK(glm::length(end) < 1e5);
}

TEST_CASE("a click selects the pyramid under it, of several the closest", "[frustums]") {
  const std::vector<soup::ModelCamera> cameras{camera_at({0, 2, 0}, {0, 0, 0}), camera_at({1.5, 1, 0}, {0, 0, 0}),
                                               camera_at({0, 1, 0}, {0, 0, 0})};
  const auto at = [&](const glm::dvec2& pixel, double reach = 2) {
    return frustum_at(cameras, 0.5, kViewer, pixel, reach);
  };
  CHECK(at(pixel_of({0, 1, 0})) == 2u);
  CHECK(at(pixel_of({1.5, 1, 0})) == 1u);
  // Inside a pyramid, away from its edges.
  CHECK(at(pixel_of({0, 0.5, 0}) + glm::dvec2(1, 2), 0.1) == 2u);
  CHECK(!at({10, 10}));
  // Just outside of the picture's edge.
  const double edge = pixel_of({0.5 * 30 / cameras[2].camera.fx, 0.5, 0}).x;
  CHECK(at({edge + 1.5, 50}) == 2u);
  CHECK(!at({edge + 3, 50}));
  CHECK(!frustum_at({}, 0.5, kViewer, {100, 50}, 2));
}

TEST_CASE("the nearest photograph has a similar place and direction", "[frustums]") {
  const std::vector<soup::ModelCamera> cameras{
      camera_at({0, -5, 0}, {0, -9, 0}),     // the same place, but looks away
      camera_at({0.5, -5, 0.2}, {0, 0, 0}),  // similar
      camera_at({2, -5, 0}, {2, 0, 0}),      // the same direction, farther away
  };
  CHECK(nearest_camera(cameras, kViewer, 5) == 1u);
  CHECK(nearest_camera(cameras, cameras[0].camera, 5) == 0u);
  CHECK(nearest_camera(cameras, cameras[2].camera, 5) == 2u);
  CHECK(!nearest_camera({}, kViewer, 5));
}
