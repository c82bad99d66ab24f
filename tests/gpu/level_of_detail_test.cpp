// Tests texture levels: the measurement in shaders/measure_visible.comp, and the levels that the change to fine levels
// and refinement choose.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "train/topology/refine.h"

using namespace trisoup;
using test::SmallScene;

namespace {

const std::vector<train::BatchView> kViews{test::view_from(0.3, 64, 48), test::view_from(1.7, 61, 55),
                                           test::view_from(3.9, 40, 70)};

/// Areas of triangles in photograph pixels, in double precision, from the change of barycentrics between pixels. Uses
/// the visible fragments in s.frame.
std::vector<double> areas_by_differences(SmallScene& s, std::span<const train::BatchView> views) {
  const auto vertices = s.gpu.download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * s.soup.triangles);
  const auto hits = s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
  std::vector<double> areas(s.soup.triangles);
  std::size_t i = 0;
  for (const train::BatchView& view : views)
    for (std::uint32_t y = 0; y < view.height; ++y)
      for (std::uint32_t x = 0; x < view.width; ++x, ++i) {
        if (hits[i].triangle == 0) continue;
        glm::dvec4 clip[3];
        for (int k = 0; k < 3; ++k)
          clip[k] = view.clip_from_world * glm::dvec4(glm::dvec3(vertices[3 * (hits[i].triangle - 1) + k]), 1);
        const auto at = [&](double dx, double dy) {
          const glm::dvec2 ndc{2 * (x + 0.5 + dx) / view.width - 1, 2 * (y + 0.5 + dy) / view.height - 1};
          const f64::PlanePoint p = f64::plane_point(clip[0], clip[1], clip[2], ndc);
          return glm::dvec2(p.b0, p.b1);
        };
        constexpr double kStep = 1e-4;
        const glm::dvec2 by_x = (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
                         by_y = (at(0, kStep) - at(0, -kStep)) / (2 * kStep);
        double& area = areas[hits[i].triangle - 1];
        area = std::max(area, view.photograph_pixels * 0.5 / std::abs(by_x.x * by_y.y - by_x.y * by_y.x));
      }
  return areas;
}

train::Settings settings_with(double samples_per_pixel) {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.steps = 100;
  s.samples_per_pixel = samples_per_pixel;
  return s;
}

}  // namespace

TEST_CASE("the area of a triangle is the largest over all pixels that show it", "[levels][each_driver]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views = kViews;
  views[1].photograph_pixels = 4;
  SmallScene s(*gpu, 40, {{0, 2}}, views, 5);
  const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, views);
  CHECK(seen.pixels == train::count_visible(*gpu, s.soup, s.buffers, views));
  const std::vector<double> expected = areas_by_differences(s, views);
  int visible = 0;
  for (std::size_t t = 0; t < expected.size(); ++t) {
    CAPTURE(t, seen.pixels[t]);
    CHECK(seen.area[t] == Approx(expected[t]).epsilon(2e-3).margin(1));  // rounded up to whole pixels
    CHECK((seen.area[t] > 0) == (seen.pixels[t] > 0));
    visible += seen.area[t] > 20;
  }
  CHECK(visible > 20);
  test::require_silence(*gpu);
}

TEST_CASE("areas are in pixels of the photograph, not of the smaller view that is measured", "[levels]") {
  auto gpu = test::open_device();
  scene::Camera camera;
  camera.width = 120, camera.height = 100;
  camera.fx = camera.fy = 130;
  camera.cx = 60, camera.cy = 50;
  camera.world_to_camera =
      glm::dmat4(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(0, 0, 1, 1));
  const train::BatchView full = train::batch_view(camera, 0.025, 2.5),
                         half = train::batch_view(camera, 0.025, 2.5, 0.5);
  CHECK(full.photograph_pixels == 1);
  CHECK(half.photograph_pixels == 4);
  SmallScene s(*gpu, 60, {{0, 0}}, {full}, 9);
  const train::TriangleVisibility large = train::measure_visible(*gpu, s.soup, s.buffers, std::span(&full, 1));
  const train::TriangleVisibility small = train::measure_visible(*gpu, s.soup, s.buffers, std::span(&half, 1));
  int compared = 0;
  for (std::size_t t = 0; t < large.area.size(); ++t)
    if (small.pixels[t] > 30) {
      CHECK(small.area[t] == Approx(large.area[t]).epsilon(0.15));  // the pixels differ, so the nearest point differs
      ++compared;
    }
  CHECK(compared > 4);
}

TEST_CASE("the change to fine levels gives every triangle the level that its pixels need", "[levels][each_driver]") {
  auto gpu = test::open_device();
  const double samples = GENERATE(0.0, 0.2, 1.0);
  SmallScene s(*gpu, 40, {{0, 0}}, kViews, 5);
  const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, kViews);
  train::add_fine_levels(*gpu, s.soup, s.buffers, kViews, settings_with(samples));
  std::map<std::uint32_t, int> levels;
  for (std::size_t t = 0; t < s.soup.table.size(); ++t) {
    const soup::TextureEntry& row = s.soup.table[t];
    ++levels[row.level_max];
    CHECK(row.level_min == 2);
    const double wanted = samples * seen.area[t];
    const auto cells = [](std::uint32_t level) { return 0.5 * std::pow(4.0, level); };
    if (samples == 0)
      CHECK(row.level_max == 5);
    else if (row.level_max > 2)
      CHECK(cells(row.level_max - 1) < wanted);
    if (samples > 0 && row.level_max < 5) CHECK(cells(row.level_max) >= wanted);
  }
  if (samples > 0) CHECK(levels.size() > 2);
  test::require_silence(*gpu);
}

TEST_CASE("a texture that is visible in no pixel keeps its level", "[levels]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 10, {{2, 4}}, kViews, 5);
  auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 30);
  for (int k = 0; k < 3; ++k) vertices[15 + k] += glm::vec3(0, 0, 40);  // out of all views
  gpu->upload(s.soup.vertices.address(), vertices);
  REQUIRE(train::measure_visible(*gpu, s.soup, s.buffers, kViews).area[5] == 0);
  train::Settings settings = settings_with(1e-6);
  settings.recipe = train::Recipe::real;
  settings.triangles = 10;
  settings.refine_every = 10;
  settings.refine_until = 0.9;
  REQUIRE(train::refine(*gpu, s.soup, s.buffers, {kViews, kViews}, settings, 90, 10) == train::RefineOutcome::done);
  REQUIRE(s.soup.triangles == 10);
  CHECK(s.soup.table[5].level_max == 4);
  CHECK(s.soup.table[0].level_max == 3);  // visible, with far too many samples before
  test::require_silence(*gpu);
}

TEST_CASE("refinement adapts levels to the visible area, and levels of halves to their share", "[levels]") {
  auto gpu = test::open_device();
  const train::Recipe recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  // The initial levels are right, too fine or too coarse.
  std::vector<soup::TextureLevels> before;
  for (std::uint32_t t = 0; t < 40; ++t) before.push_back({2, 2 + t % 4});
  SmallScene s(*gpu, 40, before, kViews, 5);
  const auto old_vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 120);
  const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, kViews);
  train::Settings settings = settings_with(0.5);
  settings.recipe = recipe;
  settings.triangles = 50;
  settings.split_length = 0.4;
  settings.refine_every = 10;
  settings.refine_until = 0.9;
  const std::uint64_t step =
      GENERATE(40u, 50u, 60u, 90u);  // before, at and after the change to fine levels; the last refinement
  REQUIRE(train::refine(*gpu, s.soup, s.buffers, {kViews, kViews}, settings, step, 80) == train::RefineOutcome::done);
  const auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * s.soup.triangles);
  int whole = 0, split = 0, coarser = 0, finer = 0;
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    // Finds the parent: the old triangle that contains all corners.
    double share = 0;
    std::uint32_t parent = 40;
    for (std::uint32_t p = 0; p < 40; ++p) {
      const glm::dvec3 a(old_vertices[3 * p]), b(old_vertices[3 * p + 1]), c(old_vertices[3 * p + 2]),
          n = glm::cross(b - a, c - a);
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        const glm::dvec3 q(vertices[3 * t + k]);
        const double b0 = glm::dot(glm::cross(b - q, c - q), n) / glm::dot(n, n),
                     b1 = glm::dot(glm::cross(c - q, a - q), n) / glm::dot(n, n);
        inside = inside && std::abs(glm::dot(q - a, n)) < 1e-6 * glm::length(n) && b0 > -1e-5 && b1 > -1e-5 &&
                 b0 + b1 < 1 + 1e-5;
      }
      if (!inside) continue;
      parent = p;
      share = glm::length(glm::cross(glm::dvec3(vertices[3 * t + 1] - vertices[3 * t]),
                                     glm::dvec3(vertices[3 * t + 2] - vertices[3 * t]))) /
              glm::length(n);
    }
    REQUIRE(parent < 40);
    ++(share > 0.999 ? whole : split);
    const soup::TextureEntry& row = s.soup.table[t];
    if (step <= 50) {
      CHECK(row.level_max == before[parent].level_max);
      continue;
    }
    const double wanted = 0.5 * share * seen.area[parent];
    const auto cells = [](std::uint32_t level) { return 0.5 * std::pow(4.0, level); };
    CAPTURE(parent, share, wanted, row.level_max);
    // Levels are never too coarse. A level finer than needed is allowed only if it was so before and is nearly needed,
    // or if it is one level coarser than before.
    if (row.level_max < 5) CHECK(cells(row.level_max) >= 0.999 * wanted);
    if (row.level_max > 2 && cells(row.level_max - 1) >= 1.001 * wanted) {
      CHECK(row.level_max <= before[parent].level_max);
      CHECK((cells(row.level_max - 1) < 1.501 * wanted || row.level_max + 1 == before[parent].level_max));
    }
    CHECK(row.level_max + 1 >= before[parent].level_max);
    coarser += row.level_max < before[parent].level_max;
    finer += row.level_max > before[parent].level_max;
  }
  CHECK(whole > 10);
  // With the real recipe, the last refinement drops triangles but does not split.
  if (step < 90 || recipe == train::Recipe::synthetic) CHECK(split > 5);
  if (step > 50) CHECK(coarser > 5);
  if (step > 50) CHECK(finer > 2);
  test::require_silence(*gpu);
}

TEST_CASE("triangles are counted in every view that shows them", "[levels]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views;
  for (int v = 0; v < 70; ++v)
    views.push_back(test::view_from(0.09 * v, 24 + v % 3, 20));  // more views than bits in two words
  SmallScene s(*gpu, 40, {{0, 2}}, views, 5);
  const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, views);
  const auto each = train::visible_in_each(*gpu, s.soup, s.buffers, views);
  std::uint32_t fewest = 70, most = 0;
  for (std::size_t t = 0; t < 40; ++t) {
    std::uint32_t expected = 0;
    for (const auto& view : each) expected += view[t];
    CHECK(seen.views[t] == expected);
    fewest = std::min(fewest, expected), most = std::max(most, expected);
  }
  CHECK(fewest < 33);
  CHECK(most > 40);
  test::require_silence(*gpu);
}

TEST_CASE("real scenes with enough views drop triangles that few views see", "[levels]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kMany = 300;  // some are hidden among the others
  const auto views_of = [](int n) {
    std::vector<train::BatchView> views;
    for (int v = 0; v < n; ++v) views.push_back(test::view_from(6.28 * v / n, 24, 20));
    return views;
  };
  const auto resampled = [&](int views_in_all, train::Recipe recipe, std::uint32_t least) {
    const auto views = views_of(views_in_all);
    SmallScene s(*gpu, kMany, {{2, 3}}, views, 5);
    const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, views);
    train::Settings settings = settings_with(1);
    settings.recipe = recipe;
    settings.triangles = kMany;
    settings.split_length = 10;
    settings.refine_every = 10;
    settings.refine_until = 0.9;
    settings.published = least == 0;
    REQUIRE(train::refine(*gpu, s.soup, s.buffers, {views, views}, settings, 90, kMany) == train::RefineOutcome::done);
    return std::pair(s.soup.triangles, seen);
  };
  const auto vouched = [](const train::TriangleVisibility& seen, std::uint32_t least) {
    return static_cast<std::uint32_t>(
        std::count_if(seen.views.begin(), seen.views.end(), [&](std::uint32_t n) { return n >= least; }));
  };
  for (const auto& [views, least] : {std::pair(60, 2u), {20, 2u}, {19, 1u}, {9, 0u}}) {
    CAPTURE(views, least);
    const auto [left, seen] = resampled(views, train::Recipe::real, 4);
    CHECK(left == vouched(seen, least));
    if (least > 0) CHECK(left < vouched(seen, least - 1));  // some are seen by one view less
    if (least > 0) CHECK(left > 10);
  }
  CHECK(resampled(60, train::Recipe::real, 0).first == kMany);
  const auto [left, seen] = resampled(60, train::Recipe::synthetic, 4);
  CHECK(left == kMany);  // split up to the budget again
}

/// Photograph pixels that show each triangle, mean over the views that do, as trainings count them.
static std::vector<double> shown_pixels(const train::TriangleVisibility& seen) {
  std::vector<double> shown;
  for (std::size_t t = 0; t < seen.pixels.size(); ++t)
    shown.push_back(seen.views[t] > 0 ? 4.0 * seen.pixels[t] / seen.views[t] : 0.0);
  return shown;
}

TEST_CASE("the largest visible triangles are split up to the budget, also at the last refinement", "[levels]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kTriangles = 60, kBudget = 63;
  const std::vector<train::BatchView> views{test::view_from(0.3, 64, 64), test::view_from(1.7, 64, 64),
                                            test::view_from(3.9, 64, 64)};
  SmallScene s(*gpu, kTriangles, {{2, 3}}, views, 5);
  const train::TriangleVisibility seen = train::measure_visible(*gpu, s.soup, s.buffers, views);
  // The expected splits: always the largest triangle.
  const std::vector<double> shown = shown_pixels(seen);
  std::vector<double> sizes = shown;
  std::vector<std::size_t> origin(kTriangles);
  for (std::size_t t = 0; t < kTriangles; ++t) origin[t] = t;
  while (sizes.size() < kBudget) {
    const auto largest = static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    sizes[largest] *= 0.5;
    sizes.push_back(sizes[largest]);
    origin.push_back(origin[largest]);
  }
  const auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * kTriangles);
  train::Settings settings = settings_with(1);
  settings.recipe = train::Recipe::real;
  settings.triangles = kBudget;
  settings.split_length = 10;
  settings.init = GENERATE("points", "surface");
  settings.refine_every = 10;
  settings.refine_until = 0.9;
  const std::uint64_t step = GENERATE(80, 90);  // 90 is the last
  REQUIRE(train::refine(*gpu, s.soup, s.buffers, {views, views}, settings, step, kBudget) ==
          train::RefineOutcome::done);
  REQUIRE(s.soup.triangles == (train::starts_from_surface(settings) ? kBudget : kTriangles));
  const auto after = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * s.soup.triangles);
  const auto area = [](const std::vector<glm::vec3>& v, std::size_t t) {
    return glm::length(glm::cross(v[3 * t + 1] - v[3 * t], v[3 * t + 2] - v[3 * t]));
  };
  for (std::size_t t = 0; t < s.soup.triangles; ++t) {
    const double whole = area(vertices, origin[t]), share = train::starts_from_surface(settings) && shown[origin[t]] > 0
                                                                ? sizes[t] / shown[origin[t]]
                                                                : 1.0;
    CHECK(area(after, t) == Approx(share * whole).epsilon(1e-4));
  }
  test::require_silence(*gpu);
}

TEST_CASE("a painted surface has no triangle that its finest texture cannot resolve", "[levels]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kTriangles = 60;
  std::vector<train::BatchView> views;
  for (int i = 0; i < 30; ++i) views.push_back(test::view_from(0.2 * i, 64, 64));
  SmallScene s(*gpu, kTriangles, {{0, 0}}, views, 5);
  constexpr std::uint32_t kUnseen = 8;  // the first ones
  auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * kTriangles);
  for (std::size_t i = 0; i < 3 * kUnseen; ++i) vertices[i].y += 100;
  gpu->upload(s.soup.vertices.address(), vertices);
  gpu->fill(s.soup.opacity.address(), s.soup.opacity.bytes(), 0x3f800000u);  // 1
  const std::vector<double> shown = shown_pixels(train::measure_visible(*gpu, s.soup, s.buffers, views));
  train::Settings settings = settings_with(1);
  settings.recipe = train::Recipe::real;
  settings.init = "surface";
  settings.level_min = settings.level_max = 3;
  const double limit = 2 * 64 / 2.0;  // two pixels for each of 4^3 / 2 samples
  std::size_t wanted = 0;
  for (double size : shown) {
    std::size_t parts = 1;
    for (; size >= limit; size /= 2) parts *= 2;
    wanted += parts;
  }
  REQUIRE(wanted > kTriangles + 10);
  settings.triangles = GENERATE(60u, 1000u);
  train::split_coarse(*gpu, s.soup, s.buffers, {views, views}, settings);
  const auto after = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * s.soup.triangles);
  const auto total = [](const std::vector<glm::vec3>& v) {
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); i += 3) sum += glm::length(glm::cross(v[i + 1] - v[i], v[i + 2] - v[i]));
    return sum;
  };
  if (settings.triangles > kTriangles) {
    CHECK(s.soup.triangles == wanted);
    CHECK(total(after) == Approx(total(vertices)));
  } else {
    // Triangles that no view shows make room.
    CHECK(s.soup.triangles == kTriangles);
    CHECK(std::none_of(after.begin(), after.end(), [](const glm::vec3& v) { return v.y > 50; }));
    CHECK(total(after) == Approx(total({vertices.begin() + 3 * kUnseen, vertices.end()})));
    const auto again = shown_pixels(train::measure_visible(*gpu, s.soup, s.buffers, views));
    CHECK(*std::max_element(again.begin(), again.end()) < *std::max_element(shown.begin(), shown.end()));
  }
  test::require_silence(*gpu);
}
