// Tests viewer/screen_selection.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "render/cameras.h"
#include "viewer/screen_selection.h"

using namespace trisoup;
using viewer::TrianglePicture;
using Triangles = std::vector<std::uint32_t>;
using Outline = std::vector<glm::dvec2>;

namespace {

/// Columns of 10 pixels that show triangles 0, 1, ..., above 10 rows of nothing.
TrianglePicture columns(std::uint32_t count) {
  TrianglePicture picture{10 * count, 30, {}};
  for (std::uint32_t y = 0; y < 30; ++y)
    for (std::uint32_t x = 0; x < picture.width; ++x) picture.hits.push_back(y < 20 ? x / 10 + 1 : 0);
  return picture;
}

const scene::Camera kCameraAlongX = render::look_at({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.9, 200, 100);

/// A triangle with corners at the pixels of kCameraAlongX, at a depth.
void add_triangle(soup::Model& model, const Outline& corners, double depth) {
  const scene::Camera& c = kCameraAlongX;
  const glm::dmat4 world = glm::inverse(c.world_to_camera);
  for (const glm::dvec2& p : corners)
    model.vertices.emplace_back(
        glm::dvec3(world * glm::dvec4(depth * (p.x - c.cx) / c.fx, depth * (p.y - c.cy) / c.fy, depth, 1)));
  model.textures.push_back({});
}

}  // namespace

TEST_CASE("the brush takes the triangles whose pixel centres it covers", "[screen_selection]") {
  const TrianglePicture picture = columns(5);
  CHECK(viewer::visible_under(picture, {{15, 10}, {15, 10}, 4}) == Triangles{1});
  CHECK(viewer::visible_under(picture, {{15, 10}, {15, 10}, 5.4}) == Triangles{1});  // the next centres are 5.5 away
  CHECK(viewer::visible_under(picture, {{15, 9.5}, {15, 9.5}, 5.6}) == Triangles{0, 1, 2});
  // A move covers what lies between its ends, but not in their box.
  CHECK(viewer::visible_under(picture, {{5, 5}, {45, 5}, 1}) == Triangles{0, 1, 2, 3, 4});
  CHECK(viewer::visible_under(picture, {{5, 28}, {45, 0}, 1}) == Triangles{1, 2, 3, 4});
  CHECK(viewer::visible_under(picture, {{25, 26}, {25, 26}, 5}).empty());
  CHECK(viewer::visible_under(picture, {{25, 26}, {25, 26}, 7}) == Triangles{2});
  // Outside of the picture.
  CHECK(viewer::visible_under(picture, {{-3, -3}, {-3, -3}, 4}).empty());
  CHECK(viewer::visible_under(picture, {{-3, -3}, {-3, -3}, 6}) == Triangles{0});
  CHECK(viewer::visible_under(picture, {{53, 10}, {1e6, 10}, 4}) == Triangles{4});
  CHECK(viewer::visible_under({}, {{1, 1}, {1, 1}, 4}).empty());
  CHECK(viewer::hit_at(picture, {49.9, 19.9}) == 5);
  CHECK(viewer::hit_at(picture, {49.9, 20}) == 0);
  CHECK(viewer::hit_at(picture, {50, 1}) == 0);
  CHECK(viewer::hit_at(picture, {-0.1, 1}) == 0);
}

TEST_CASE("the lasso takes triangles of which it holds at least half", "[screen_selection]") {
  const TrianglePicture picture = columns(5);
  const auto box = [](double x0, double y0, double x1, double y1) {
    return Outline{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
  };
  CHECK(viewer::visible_inside(picture, box(5, -5, 35, 40)) == Triangles{0, 1, 2, 3});
  CHECK(viewer::visible_inside(picture, box(6, -5, 34, 40)) == Triangles{1, 2});
  CHECK(viewer::visible_inside(picture, box(-5, 0, 60, 10)) == Triangles{0, 1, 2, 3, 4});
  CHECK(viewer::visible_inside(picture, box(-5, 0, 60, 9)).empty());
  // Not convex: everything except the middle.
  const Outline comb{{-1, -1}, {51, -1}, {51, 31}, {30, 31}, {30, 1}, {20, 1}, {20, 31}, {-1, 31}};
  CHECK(viewer::visible_inside(picture, comb) == Triangles{0, 1, 3, 4});
  CHECK(viewer::visible_inside(picture, Outline{{0, 0}, {50, 30}}).empty());
  CHECK(viewer::visible_inside(picture, {}).empty());
}

TEST_CASE("hidden triangles are selected by their projection", "[screen_selection]") {
  soup::Model model;
  // Moved and scaled, as datasets are.
  for (const double depth : {2.0, 3.0}) add_triangle(model, {{20, 20}, {60, 20}, {20, 80}}, depth);
  add_triangle(model, {{120, 20}, {160, 20}, {120, 80}}, 2);
  add_triangle(model, {{20, 20}, {60, 20}, {20, 80}}, -2);  // behind the camera
  const auto under = [&](const glm::dvec2& from, const glm::dvec2& to, double radius, double near = 0.01) {
    return viewer::all_under(model, kCameraAlongX, near, {from, to, radius});
  };
  CHECK(under({30, 30}, {30, 30}, 1) == Triangles{0, 1});
  CHECK(under({30, 30}, {30, 30}, 1, 2.5) == Triangles{1});
  CHECK(under({70, 20}, {70, 20}, 9).empty());
  CHECK(under({70, 20}, {70, 20}, 11) == Triangles{0, 1});
  CHECK(under({70, 90}, {170, 10}, 1) == Triangles{2});
  CHECK(under({0, 0}, {199, 0}, 5).empty());
  CHECK(under({140, 0}, {140, 99}, 1) == Triangles{2});
  const auto inside = [&](const Outline& outline, double near = 0.01) {
    return viewer::all_inside(model, kCameraAlongX, near, outline);
  };
  // Centroids at (33.3, 40) and (133.3, 40).
  CHECK(inside({{32, 38}, {35, 38}, {35, 42}, {32, 42}}) == Triangles{0, 1});
  CHECK(inside({{32, 38}, {35, 38}, {35, 42}, {32, 42}}, 2.5) == Triangles{1});
  CHECK(inside({{40, 0}, {200, 0}, {200, 100}, {40, 100}}) == Triangles{2});
  CHECK(inside({}).empty());
  // The model's own coordinates make no difference.
  model.scale = 0.5;
  model.centre = {3, 4, 5};
  model.origin = {3, 4, 5};
  for (glm::vec3& v : model.vertices) v *= 2;
  CHECK(under({30, 30}, {30, 30}, 1) == Triangles{0, 1});
}

TEST_CASE("a triangle across the camera is selected by its part in front", "[screen_selection]") {
  soup::Model model;
  // A floor below the camera, from behind it to far ahead.
  model.vertices = {{-1, -1, -0.5f}, {-1, 1, -0.5f}, {100, 0, -0.5f}};
  model.textures.push_back({});
  CHECK(viewer::all_under(model, kCameraAlongX, 0.01, {{100, 90}, {100, 90}, 1}) == Triangles{0});
  CHECK(viewer::all_under(model, kCameraAlongX, 0.01, {{100, 10}, {100, 10}, 1}).empty());
}
