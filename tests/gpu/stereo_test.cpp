// Tests engine/scene/stereo (shaders/patch_match*.comp) on planes of known depth.
#include <catch2/catch.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

#include "gpu/board_scene.h"
#include "gpu/small_scene.h"
#include "scene/stereo/dense_points.h"
#include "scene/stereo/depth_maps.h"
#include "scene/stereo/neighbours.h"
#include "scene/stereo/support.h"
#include "scene/stereo/surface_points.h"

using namespace trisoup;
using test::eye_of;
using test::photographs;
using test::ray_of;
using test::true_depth;

namespace {

struct Accuracy {
  double median = 0, found = 0;  // relative error of depth; share of pixels on which two neighbours agree
};
Accuracy accuracy(const std::vector<scene::DepthMap>& maps) {
  std::vector<double> errors;
  std::size_t all = 0;
  for (std::size_t v = 0; v < maps.size(); ++v)
    for (int y = 0; y < maps[v].camera.height; ++y)
      for (int x = 0; x < maps[v].camera.width; ++x, ++all) {
        const auto pixel = static_cast<std::size_t>(y * maps[v].camera.width + x);
        if (std::popcount(maps[v].agreeing[pixel]) < 2) continue;
        const double depth = true_depth(eye_of(static_cast<int>(v)), ray_of(maps[v].camera, x, y));
        errors.push_back(std::abs(double(maps[v].planes[pixel].x) * depth - 1));
      }
  REQUIRE(!errors.empty());
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  return {errors[errors.size() / 2], static_cast<double>(errors.size()) / static_cast<double>(all)};
}

/// The maps of `photographs(6)`, computed once.
const std::vector<scene::DepthMap>& maps_of_six() {
  static const std::vector<scene::DepthMap> maps = [] {
    auto gpu = test::open_device();
    return scene::depth_maps(*gpu, photographs(6), {}, {});
  }();
  return maps;
}

}  // namespace

TEST_CASE("stereo of three photographs finds the depth of slanted planes", "[stereo][each_driver]") {
  auto gpu = test::open_device();
  const Accuracy all = accuracy(scene::depth_maps(*gpu, photographs(3), {}, {}));
  CHECK(all.median < 0.002);
  CHECK(all.found > 0.65);
  test::require_silence(*gpu);
}

TEST_CASE("stereo finds the depth of slanted planes", "[stereo][trainer][same_code]") {
  const std::vector<scene::DepthMap>& maps = maps_of_six();
  REQUIRE(maps.size() == 6);
  for (const scene::DepthMap& map : maps) CHECK(map.neighbours.size() >= 3);
  const Accuracy all = accuracy(maps);
  CHECK(all.median < 0.004);
  CHECK(all.found > 0.75);

  const scene::Points points = scene::dense_points(maps);
  REQUIRE(points.positions.size() > 1000);
  std::vector<double> errors, of_two;  // pixels in the neighbour with the widest baseline
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    REQUIRE(points.seen_by[i].size() >= 2);
    CHECK(std::is_sorted(points.seen_by[i].begin(), points.seen_by[i].end()));
    const std::uint32_t v = points.seen_by[i].front();
    const glm::dvec3 eye = eye_of(static_cast<int>(v)), q = glm::dvec3(points.positions[i]) - eye;
    (points.seen_by[i].size() == 2 ? of_two : errors)
        .push_back(std::abs(1 / q.z - 1 / true_depth(eye, q / q.z)) / maps[v].pixel_step);
  }
  std::sort(errors.begin(), errors.end());
  std::sort(of_two.begin(), of_two.end());
  CHECK(errors[errors.size() / 2] < 0.1);
  CHECK(errors[errors.size() * 96 / 100] < 0.5);
  REQUIRE(of_two.size() > 100);
  CHECK(of_two[of_two.size() / 2] < 0.1);
  CHECK(of_two[of_two.size() * 95 / 100] < 1.5);
}

TEST_CASE("stereo leaves masked and plain pixels out", "[stereo][trainer]") {
  auto gpu = test::open_device();
  std::vector<scene::View> views = photographs(6);
  for (scene::View& v : views)
    for (int y = 0; y < test::kBoardHeight; ++y)
      for (int x = 0; x < test::kBoardWidth; ++x) {
        std::uint8_t* p = &v.image.rgba[static_cast<std::size_t>(4 * (y * test::kBoardWidth + x))];
        if (y < 20) p[3] = 0;
        if (y >= 44) p[0] = p[1] = p[2] = 128;
      }
  const std::vector<scene::DepthMap> maps = scene::depth_maps(*gpu, views, {}, {});
  for (const scene::DepthMap& map : maps)
    for (int y = 0; y < test::kBoardHeight; ++y)
      for (int x = 0; x < test::kBoardWidth; ++x)
        if (y < 20 || y >= 48) CHECK(map.agreeing[static_cast<std::size_t>(y * test::kBoardWidth + x)] == 0);
}

TEST_CASE("two views find the depth of what a third one shows otherwise", "[stereo][trainer]") {
  auto gpu = test::open_device();
  std::vector<scene::View> views = photographs(3);
  for (std::size_t i = 0; i < views[2].image.rgba.size(); ++i)  // noise: nothing of the scene
    if (i % 4 != 3) views[2].image.rgba[i] = static_cast<std::uint8_t>(i * i * 2654435761u >> 13);
  const std::vector<scene::DepthMap> maps = scene::depth_maps(*gpu, views, {}, {});
  int right = 0, wrong = 0;
  for (int v = 0; v < 2; ++v)
    for (int y = 0; y < test::kBoardHeight; ++y)
      for (int x = 0; x < test::kBoardWidth; ++x) {
        const scene::DepthMap& map = maps[static_cast<std::size_t>(v)];
        const auto pixel = static_cast<std::size_t>(y * map.camera.width + x);
        if (map.agreeing[pixel] == 0) continue;
        const double depth = true_depth(eye_of(v), ray_of(map.camera, x, y));
        ++(std::abs(double(map.planes[pixel].x) * depth - 1) < 0.02 ? right : wrong);
      }
  CHECK(right > 7000);
  CHECK(wrong < 650);  // 817 without drop_unsupported()
}

TEST_CASE("planes of one neighbour need support by the pixels around", "[stereo][trainer]") {
  scene::DepthMap map;
  map.camera.width = map.camera.height = 16;
  map.pixel_step = 1e-4;
  const auto at = [](int x, int y) { return static_cast<std::size_t>(16 * y + x); };
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) map.planes.emplace_back(1.0f + 0.05f * float(x), 0.05f, 0.0f, 0.1f);
  map.agreeing.assign(256, 1);
  map.planes[at(8, 8)] = glm::vec4(3.0f, 0.0f, 0.0f, 0.0f);  // matches well, but stands alone
  map.planes[at(3, 12)] = glm::vec4(3.0f, 0.0f, 0.0f, 0.0f);
  map.agreeing[at(3, 12)] = 3;  // stands alone too, but two neighbours agree
  map.agreeing[at(12, 3)] = 0;
  std::vector<std::uint32_t> expected = map.agreeing;
  expected[at(8, 8)] = 0;
  scene::drop_unsupported(map);
  CHECK(map.agreeing == expected);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) map.agreeing[at(x, y)] = x % 4 == 0 ? 1 : 0;  // lines without neighbours
  scene::drop_unsupported(map);
  CHECK(std::count(map.agreeing.begin(), map.agreeing.end(), 0u) == 256);
}

TEST_CASE("stereo needs views with parallax", "[stereo]") {
  auto gpu = test::open_device();
  CHECK(scene::depth_maps(*gpu, {}, {}, {}).empty());
  const std::vector<scene::View> one = photographs(1);
  CHECK(scene::surface_points(*gpu, one, {}, 500).positions.empty());
  std::vector<scene::View> twice = photographs(1);
  twice.push_back(twice.front());
  CHECK(scene::surface_points(*gpu, twice, {}, 500).positions.empty());
}

TEST_CASE("sightings are completed and mismatches dropped", "[stereo][trainer]") {
  const std::vector<scene::DepthMap>& maps = maps_of_six();
  scene::Points points;
  points.positions = {{0.3f, 0.0f, 1.6f - 0.35f * 0.3f}, {0.3f, 0.0f, 0.0f}};  // on the floor; far before it
  points.colours = {{255, 0, 0}, {0, 255, 0}};
  points.errors = {0.5f, 0.7f};
  points.seen_by = {{0, 1}, {0, 1}};
  const scene::Points checked = scene::checked_sightings(points, maps);
  REQUIRE(checked.positions.size() == 1);
  CHECK(checked.positions[0] == points.positions[0]);
  CHECK(checked.errors == std::vector<float>{0.5f});
  CHECK(checked.seen_by[0].size() >= 5);
}

TEST_CASE("views with maps are spread over the positions", "[stereo]") {
  std::vector<scene::View> views = photographs(6);
  views[0].camera.world_to_camera[3].x += 5;  // far from all others
  views[5].image.rgba.clear();
  const std::vector<std::uint32_t> two = scene::spread_views(views, 2);
  REQUIRE(two.size() == 2);
  CHECK(two[0] == 0);
  CHECK(scene::spread_views(views, 9) == std::vector<std::uint32_t>{0, 1, 2, 3, 4});
}
