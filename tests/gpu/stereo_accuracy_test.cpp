// Tests how exact and how complete the depths of engine/scene/stereo/depth_maps.cpp are. With -s it prints the figures.
#include <catch2/catch.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <numeric>
#include <vector>

#include "gpu/small_scene.h"
#include "gpu/traced_boxes.h"
#include "scene/stereo/depth_maps.h"
#include "shared_data.h"

using namespace trisoup;

namespace {

/// Of depths that two neighbours agree on: relative errors, and their pixels as shares of all pixels.
struct DepthFigures {
  double median = 0, mean = 0;
  double shown = 0;                              // pixels whose surface two other views show: what can be found
  double found = 0, within_2 = 0, within_5 = 0;  // with a depth; with one that is off by at most 2 %, 5 %
};

/// Whether two of the views, other than the pixel's own, show the surface that a pixel shows.
bool shown_twice(const std::vector<scene::DepthMap>& maps, const scene::DepthMap& own, const glm::dvec3& place,
                 const test::BoxScene& truth, const scene::Normalisation& normalisation) {
  int showing = 0;
  for (const scene::DepthMap& map : maps) {
    const auto there = scene::shown_at(map.camera, place);
    if (&map == &own || !there) continue;
    const double first = test::depth_at(truth, normalisation, map.camera, there->pixel.x, there->pixel.y);
    if (there->depth < 1.001 * first && ++showing == 2) return true;
  }
  return false;
}

DepthFigures depth_figures(const std::vector<scene::DepthMap>& maps, const test::BoxScene& truth,
                           const scene::Normalisation& normalisation) {
  std::vector<double> errors;
  std::size_t pixels = 0, shown = 0;
  for (const scene::DepthMap& map : maps) {
    const scene::Camera& c = map.camera;
    const glm::dmat4 to_world = glm::inverse(c.world_to_camera);
    pixels += map.planes.size();
    for (std::size_t i = 0; i < map.planes.size(); ++i) {
      const double x = static_cast<double>(i % static_cast<std::size_t>(c.width)) + 0.5,
                   y = static_cast<double>(i / static_cast<std::size_t>(c.width)) + 0.5;
      const double depth = test::depth_at(truth, normalisation, c, x, y), inverse = map.planes[i].x;
      const glm::dvec4 place = to_world * glm::dvec4(depth * (x - c.cx) / c.fx, depth * (y - c.cy) / c.fy, depth, 1);
      shown += shown_twice(maps, map, glm::dvec3(place), truth, normalisation);
      if (std::popcount(map.agreeing[i]) >= 2 && inverse > 0) errors.push_back(std::abs(1 / (inverse * depth) - 1));
    }
  }
  REQUIRE(!errors.empty());
  std::sort(errors.begin(), errors.end());
  const auto share = [&](double most) {
    return static_cast<double>(std::upper_bound(errors.begin(), errors.end(), most) - errors.begin()) /
           static_cast<double>(pixels);
  };
  return {.median = errors[errors.size() / 2],
          .mean = std::accumulate(errors.begin(), errors.end(), 0.0) / static_cast<double>(errors.size()),
          .shown = static_cast<double>(shown) / static_cast<double>(pixels),
          .found = share(errors.back()),
          .within_2 = share(0.02),
          .within_5 = share(0.05)};
}

/// Distance of a place from the nearest plane of a room's surfaces.
double distance_to_surface(const test::BoxScene& room, const glm::dvec3& p) {
  double least = std::abs(p.z - room.floor);
  for (int k = 0; k < 3; ++k) least = std::min(least, std::abs(std::abs(p[k]) - room.boxes[0].high[k]));
  for (int k = 0; k < 2; ++k) least = std::min(least, std::abs(std::abs(p[k]) - room.wall));
  return least;
}

/// The size at which the values below were measured.
scene::DepthMapOptions as_measured() {
  scene::DepthMapOptions options;
  options.pixels = 1'600'000;
  return options;
}

}  // namespace

// Measured values follow the limits, then those without the neighbours' planes as witnesses (kCostPerPixel = 0).
TEST_CASE("stereo finds the depths of a room with a box", "[stereo][accuracy]") {
  auto gpu = test::open_device();
  const scene::Normalisation normalisation{glm::dvec3(0), 0.3};
  const test::BoxScene truth = test::room_with_box();
  const std::vector<scene::View> views = test::photographs_round(truth, normalisation, 3.2, {0.7, 1.3, 1.9});
  const DepthFigures room = depth_figures(scene::depth_maps(*gpu, views, {}, as_measured()), truth, normalisation);
  CHECK(room.median < 0.0028);  // 0.0026   0.0030
  CHECK(room.mean < 0.0163);    // 0.0148   0.0110
  CHECK(room.shown > 0.9);      // 0.904
  CHECK(room.found > 0.72);     // 0.742    0.657
  CHECK(room.within_2 > 0.66);  // 0.683    0.607
  CHECK(room.within_5 > 0.70);  // 0.725    0.648
}

TEST_CASE("stereo finds the depths of streets", "[stereo][accuracy]") {
  auto gpu = test::open_device();
  const scene::Normalisation normalisation{glm::dvec3(0), 0.2};
  const test::BoxScene truth = test::streets();
  const std::vector<scene::View> views = test::photographs_round(truth, normalisation, 3.4, {2.8, 3.4, 4});
  const DepthFigures town = depth_figures(scene::depth_maps(*gpu, views, {}, as_measured()), truth, normalisation);
  CHECK(town.median < 0.0052);  // 0.0047   0.0052
  CHECK(town.mean < 0.0238);    // 0.0216   0.0207
  CHECK(town.shown > 0.93);     // 0.940
  CHECK(town.found > 0.72);     // 0.745    0.676
  CHECK(town.within_2 > 0.57);  // 0.595    0.549
  CHECK(town.within_5 > 0.63);  // 0.660    0.609
}

TEST_CASE("stereo finds the depths of 16 small photographs of a room", "[stereo][accuracy][shared]") {
  REQUIRE_SHARED_FOLDER(shared);
  const std::filesystem::path dataset = shared / "inputs/_reference/dataset";
  if (!std::filesystem::is_directory(dataset)) {
    WARN("TRISOUP_SHARED has no inputs: skipped");
    return;
  }
  scene::LoadOptions options;
  options.test_every = 0;
  const scene::Scene scene = scene::load(dataset, options);
  const test::BoxScene truth = test::room_with_box();
  for (const glm::vec3& point : scene.points.positions) {  // the room is the one whose depths are computed
    const glm::dvec3 p = scene.normalisation.to_world(glm::dvec3(point));
    CHECK(distance_to_surface(truth, p) < 1e-4);
  }
  auto gpu = test::open_device();
  const DepthFigures room =
      depth_figures(scene::depth_maps(*gpu, scene.train, scene.points, as_measured()), truth, scene.normalisation);
  CHECK(room.median < 0.009);   // 0.0080   0.0072
  CHECK(room.mean < 0.038);     // 0.0341   0.0239
  CHECK(room.shown > 0.9);      // 0.902
  CHECK(room.found > 0.68);     // 0.718    0.509
  CHECK(room.within_2 > 0.47);  // 0.512    0.374
  CHECK(room.within_5 > 0.61);  // 0.647    0.472
}
