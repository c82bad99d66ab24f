// Tests engine/scene/points_from_views.h on planes of known depth.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "scene/points_from_views.h"
#include "speckle.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr double kWall = 3.0, kBoard = 1.0;  // z of a wall and of a board in front of it

/// Cameras on a line that look along z at a wall, with a board in front of its left half.
std::vector<View> views(int count) {
  std::vector<View> result;
  for (int k = 0; k < count; ++k) {
    View v;
    Camera& c = v.camera;
    c.width = kWidth, c.height = kHeight, c.fx = c.fy = 90, c.cx = 47, c.cy = 33;
    const glm::dvec3 eye(0.18 * (k % 4), 0.18 * (k / 4), -1);
    c.world_to_camera[3] = glm::dvec4(-eye, 1);
    v.image = {kWidth, kHeight, {}};
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const glm::dvec3 ray((x + 0.5 - c.cx) / c.fx, (y + 0.5 - c.cy) / c.fy, 1);
        const glm::dvec3 board = eye + (kBoard - eye.z) * ray, wall = eye + (kWall - eye.z) * ray;
        const bool on_board = board.x < 0.2;
        const double grey =
            on_board ? test::speckle(18 * board.x, 18 * board.y) : test::speckle(9 * wall.x + 100, 9 * wall.y);
        for (int channel = 0; channel < 3; ++channel) v.image.rgba.push_back(static_cast<std::uint8_t>(grey));
        v.image.rgba.push_back(255);
      }
    result.push_back(std::move(v));
  }
  return result;
}

}  // namespace

TEST_CASE("points lie on the photographed surfaces", "[points_from_views]") {
  const std::vector<View> photographs = views(8);
  const Points points = points_from_views(photographs, 2);
  REQUIRE(points.positions.size() > 150);
  REQUIRE(points.colours.size() == points.positions.size());
  REQUIRE(points.seen_by.size() == points.positions.size());
  std::size_t wall = 0, board = 0;
  for (const glm::vec3& p : points.positions) {
    wall += std::abs(p.z - kWall) < 0.1 * (kWall + 1);
    board += std::abs(p.z - kBoard) < 0.05 * (kBoard + 1);
  }
  INFO(points.positions.size() << " points, wall " << wall << ", board " << board);
  CHECK(double(wall + board) > 0.95 * double(points.positions.size()));
  CHECK(wall > 40);
  CHECK(board > 40);
  for (const auto& seen : points.seen_by) {
    CHECK(seen.size() >= 3);
    CHECK(std::is_sorted(seen.begin(), seen.end()));
    CHECK(seen.back() < photographs.size());
  }
}

TEST_CASE("the points are the same for any number of threads", "[points_from_views]") {
  const std::vector<View> photographs = views(6);
  const Points one = points_from_views(photographs, 1), three = points_from_views(photographs, 3);
  CHECK(one.positions == three.positions);
  CHECK(one.seen_by == three.seen_by);
}

TEST_CASE("without matches there are no points", "[points_from_views]") {
  CHECK(points_from_views({}).positions.empty());
  CHECK(points_from_views(views(1)).positions.empty());
  std::vector<View> twice = views(1);
  twice.push_back(twice[0]);
  CHECK(points_from_views(twice).positions.empty());
  std::vector<View> blank = views(6);
  for (View& v : blank) std::fill(v.image.rgba.begin(), v.image.rgba.end(), std::uint8_t(255));
  CHECK(points_from_views(blank).positions.empty());
  std::vector<View> masked = views(6);
  for (View& v : masked)
    for (std::size_t p = 3; p < v.image.rgba.size(); p += 4) v.image.rgba[p] = 0;
  CHECK(points_from_views(masked).positions.empty());
  std::vector<View> tiny = views(6);
  for (View& v : tiny) v.camera.width = v.camera.height = v.image.width = v.image.height = 1, v.image.rgba.resize(4);
  CHECK(points_from_views(tiny).positions.empty());
}
