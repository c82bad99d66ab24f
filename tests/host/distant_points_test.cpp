#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "scene/stereo/dense_points.h"
#include "scene/stereo/distant_points.h"
#include "scene/stereo/parallax.h"

using namespace trisoup;

namespace {

constexpr int kAcross = 120, kDown = 80;
constexpr double kFocal = 60;

/// Depth maps of cameras that look along z and agree with each other. above, below: inverse depth of the upper and the
/// lower half.
std::vector<scene::DepthMap> flat_maps(std::span<const glm::dvec3> eyes, float above, float below) {
  std::vector<scene::DepthMap> maps;
  for (std::uint32_t v = 0; v < eyes.size(); ++v) {
    scene::DepthMap& map = maps.emplace_back();
    scene::Camera& c = map.camera;
    c.width = kAcross, c.height = kDown, c.fx = c.fy = kFocal, c.cx = kAcross / 2.0, c.cy = kDown / 2.0;
    c.world_to_camera[3] = glm::dvec4(-eyes[v], 1);
    double farthest = 0;
    for (std::uint32_t n = 0; n < eyes.size(); ++n)
      if (n != v) map.neighbours.push_back(n), farthest = std::max(farthest, glm::distance(eyes[n], eyes[v]));
    map.pixel_step = 1 / (kFocal * farthest);
    for (int y = 0; y < kDown; ++y)
      for (int x = 0; x < kAcross; ++x) map.planes.emplace_back(y < kDown / 2 ? above : below, 0, 0, 0.1);
    map.agreeing.assign(map.planes.size(), 3u);
  }
  return maps;
}

}  // namespace

TEST_CASE("parallax is the distance from the image at infinity", "[stereo]") {
  scene::Camera camera = flat_maps(std::vector<glm::dvec3>{{0.2, 0, 0}}, 1, 1).front().camera;
  CHECK(std::abs(scene::parallax(camera, {0, 0, 0}, {0, 0, 2}) - kFocal * 0.2 / 2) < 1e-9);
  CHECK(scene::parallax(camera, {0.2, 0, -1}, {0.2, 0, 2}) < 1e-9);  // ahead of a camera that moves there
  CHECK(scene::parallax(camera, {0, 0, 0}, {0, 0, -2}) == 0);
}

TEST_CASE("distant points are where maps show nothing near", "[stereo]") {
  const std::vector<glm::dvec3> eyes{{-0.2, 0, 0}, {0, 0, 0}, {0.2, 0, 0}};
  const scene::Points points = scene::distant_points(flat_maps(eyes, 1e-4f, 1));
  REQUIRE(points.positions.size() > 50);
  CHECK(points.distant == points.positions.size());
  REQUIRE(points.seen_by.size() == points.positions.size());
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    const glm::dvec3 p(points.positions[i]);
    CHECK(points.seen_by[i].size() >= 2);
    CHECK(std::abs(glm::length(p) - 0.2 * kFocal) < 1e-4);
    CHECK((p.z > 0 && p.y < 0));  // y points down
  }
  CHECK(scene::distant_points(flat_maps(eyes, 1, 1)).positions.empty());
  CHECK(scene::distant_points({}).positions.empty());
}

TEST_CASE("what stays in place because cameras move towards it is not distant", "[stereo]") {
  const std::vector<glm::dvec3> eyes{{0, 0, 0}, {0, 0, 0.2}, {0, 0, 0.4}};
  const scene::Points points = scene::distant_points(flat_maps(eyes, 1e-4f, 1e-4f));
  REQUIRE(points.positions.size() > 50);
  for (const glm::vec3& p : points.positions) CHECK(std::hypot(p.x, p.y) / p.z * kFocal > 15);
}

TEST_CASE("a narrow baseline vouches for what is far, compared with all cameras", "[stereo]") {
  // 1.5 pixels of parallax between three cameras say 4.8 or more. A fourth camera, whose map shows nothing, sets the
  // extent.
  const auto points_with = [](double beside, float inverse_depth) {
    const std::vector<glm::dvec3> eyes{{-0.1, 0, 0}, {0, 0, 0}, {0.1, 0, 0}, {0, beside, 0}};
    std::vector<scene::DepthMap> maps = flat_maps(eyes, inverse_depth, inverse_depth);
    maps.back().agreeing.assign(maps.back().planes.size(), 0u);
    return scene::dense_points(maps).positions.size();
  };
  constexpr float kShort = 1.5f / (60 * 0.2f), kLong = 3.0f / (60 * 0.2f), kNone = 0.5f / (60 * 0.2f);
  CHECK(points_with(2, kShort) > 1000);  // far begins at 3
  CHECK(points_with(10, kShort) == 0);   // at 15
  CHECK(points_with(10, kLong) > 1000);  // its depth is told
  CHECK(points_with(2, kNone) == 0);
  const scene::CameraCloud cameras =
      scene::camera_cloud(flat_maps(std::vector<glm::dvec3>{{-0.1, 0, 0}, {0, 0, 0}, {0.1, 0, 0}, {0, 2, 0}}, 1, 1));
  CHECK(cameras.centre.y == Approx(0.5));
  CHECK(cameras.radius == Approx(1.5));
}

TEST_CASE("planes that are less sure only fill what sure ones leave open", "[stereo]") {
  // The maps of three cameras differ by 1 %, so that a point tells which map it is from: one surface to fusion.
  const std::vector<glm::dvec3> eyes{{-0.2, 0, 0}, {0, 0, 0}, {0.2, 0, 0}};
  std::vector<scene::DepthMap> maps = flat_maps(eyes, 1, 1);
  for (std::size_t v = 0; v < maps.size(); ++v)
    for (glm::vec4& plane : maps[v].planes) plane.x = 1.0f + 0.01f * static_cast<float>(v);
  const auto from = [&](std::size_t v) {
    std::size_t count = 0;
    for (const glm::vec3& p : scene::dense_points(maps).positions)
      count += std::abs(1 / p.z - 1.0 - 0.01 * static_cast<double>(v)) < 1e-3;
    return count;
  };
  SECTION("the first map comes first among equals") { CHECK((from(0) > 5000 && from(2) < 3000)); }
  SECTION("a plane that one neighbour has too comes later") {
    maps[0].agreeing.assign(maps[0].planes.size(), 1u), maps[1].agreeing = maps[0].agreeing;
    CHECK((from(0) > 100 && from(0) < 5000 && from(2) > 5000));
  }
  SECTION("a plane that matches worse comes later") {
    for (std::size_t v = 0; v < 2; ++v)
      for (glm::vec4& plane : maps[v].planes) plane.w = 0.5f;
    CHECK((from(0) > 100 && from(0) < 5000 && from(2) > 5000));
  }
  SECTION("a plane that matches too badly counts for nothing") {
    for (scene::DepthMap& map : maps)
      for (glm::vec4& plane : map.planes) plane.w = 0.7f;
    CHECK(scene::dense_points(maps).positions.empty());
  }
}

TEST_CASE("sightings by views that match badly count only where few match well", "[stereo]") {
  std::vector<glm::dvec3> eyes;
  for (int v = 0; v < 6; ++v) eyes.emplace_back(0.1 * v, 0, 0);
  const auto most_sightings = [&](std::size_t matching_well) {
    std::vector<scene::DepthMap> maps = flat_maps(eyes, 1, 1);
    for (std::size_t v = matching_well; v < maps.size(); ++v)
      for (glm::vec4& plane : maps[v].planes) plane.w = 0.5f;
    const scene::Points points = scene::dense_points(maps);
    std::size_t most = 0;
    for (std::size_t i = 0; i < points.positions.size(); ++i)  // in the middle, which all cameras show
      if (std::abs(points.positions[i].x - 0.25f) < 0.5f) most = std::max(most, points.seen_by[i].size());
    return most;
  };
  CHECK(most_sightings(3) == 6);
  CHECK(most_sightings(4) == 4);
  CHECK(most_sightings(5) == 5);
}
