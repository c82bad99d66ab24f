// Tests engine/scene/normalisation.h: centre and scale of the cameras.
#include <catch2/catch.hpp>

#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "scene/normalisation.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

Camera looking(const glm::dvec3& from, const glm::dvec3& at) {
  Camera camera{100, 80, 90, 90, 50, 40, glm::dmat4(1.0)};
  // lookAt has OpenGL axes; a half turn about x gives OpenCV axes.
  camera.world_to_camera = glm::rotate(glm::dmat4(1.0), glm::radians(180.0), glm::dvec3(1, 0, 0)) *
                           glm::lookAt(from, at, glm::dvec3(0.1, 0.2, 1.0));
  return camera;
}

double mean_distance(const std::vector<Camera>& cameras, const Normalisation& normalisation) {
  double sum = 0;
  for (const Camera& camera : cameras) sum += glm::length(normalised(camera, normalisation).centre());
  return sum / double(cameras.size());
}

}  // namespace

TEST_CASE("the point that cameras surround becomes the origin, at mean distance 1", "[scene][normalisation]") {
  const glm::dvec3 target(10, -5, 3);
  std::vector<Camera> cameras;
  for (int i = 0; i < 7; ++i)
    cameras.push_back(looking(target + (3.0 + 0.3 * i) * glm::dvec3(std::cos(i), std::sin(i), 0.4 + 0.1 * i), target));
  const Normalisation n = find_normalisation(cameras, {}, "scene");
  CHECK(glm::distance(n.centre, target) < 1e-9);
  CHECK(mean_distance(cameras, n) == Approx(1.0));
  CHECK(glm::distance(n.to_world(n.to_normalised({1, 2, 3})), glm::dvec3(1, 2, 3)) < 1e-12);

  // Projections do not change.
  const glm::dvec4 world(9.5, -4.8, 3.1, 1.0), unit(n.to_normalised(glm::dvec3(world)), 1.0);
  const glm::dvec4 a = clip_from_world(cameras[2], 0.1, 10) * world;
  const glm::dvec4 b = clip_from_world(normalised(cameras[2], n), 0.1, 10) * unit;
  CHECK(a.x / a.w == Approx(b.x / b.w));
  CHECK(a.y / a.w == Approx(b.y / b.w));
  CHECK(b.w == Approx(a.w * n.scale));
}

TEST_CASE("parallel axes: the centre lies ahead, at the median depth of the points if there are any",
          "[scene][normalisation]") {
  std::vector<Camera> cameras;
  for (int i = 0; i < 5; ++i) cameras.push_back(looking({i * 0.1, 0, 0}, {i * 0.1 + 1e-4 * (i % 2), 10, 0}));
  PointCloud points;
  for (const double depth : {4.0, 5.0, 6.0, -3.0, 70.0, 4.5}) points.positions.emplace_back(0.2, depth, 0);
  Normalisation n = find_normalisation(cameras, points, "scene");
  CHECK(glm::distance(n.centre, glm::dvec3(0.2, 5, 0)) < 0.01);
  CHECK(mean_distance(cameras, n) == Approx(1.0));
  n = find_normalisation(cameras, {}, "scene");
  CHECK(n.centre.y == Approx(4 * 0.12).epsilon(0.01));  // four times the mean distance from the centre of the cameras
  CHECK(mean_distance(cameras, n) == Approx(1.0));
}

TEST_CASE("the centre of two cameras that face each other is between them", "[scene][normalisation]") {
  const std::vector<Camera> cameras{looking({-2, 0, 0}, {0, 0, 0}), looking({4, 0, 0}, {0, 0, 0})};
  const Normalisation n = find_normalisation(cameras, {}, "scene");
  CHECK(glm::distance(n.centre, glm::dvec3(1, 0, 0)) < 1e-9);
  CHECK(n.scale == Approx(1.0 / 3));
}

TEST_CASE("a single camera", "[scene][normalisation]") {
  const std::vector<Camera> one{looking({0, -4, 0}, {0, 0, 0})};
  CHECK(glm::length(find_normalisation(one, {}, "scene").centre) < 1e-9);
  CHECK(find_normalisation(one, {}, "scene").scale == Approx(0.25));
  PointCloud points;
  points.positions = {{0.5, -2, 0}};
  CHECK(find_normalisation(one, points, "scene").scale == Approx(0.5));
  const std::vector<Camera> at_origin{looking({0, 0, 0}, {0, 1, 0})};
  CHECK(find_normalisation(at_origin, {}, "scene").scale == Approx(1.0));
}

TEST_CASE("several cameras at one position are an Error", "[scene][normalisation]") {
  for (const glm::dvec3 spot : {glm::dvec3(0), glm::dvec3(100, 20, 3)}) {
    const std::vector<Camera> cameras{looking(spot, spot + glm::dvec3(1, 0, 0)),
                                      looking(spot, spot + glm::dvec3(0, 1, 0)),
                                      looking(spot, spot + glm::dvec3(1, 1, 1))};
    CHECK(test::message_of([&] {
            find_normalisation(cameras, {}, "scene");
          }).starts_with("scene: all 3 cameras are at one spot; "));
  }
}
