// Tests views that are shaded from the eye of a neighbour: train/step/neighbour_eyes.h and BatchView::eye_shift.
#include <catch2/catch.hpp>

#include <cmath>

#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "train/step/neighbour_eyes.h"
#include "train/step/training_views.h"

using namespace trisoup;
using test::SmallScene;

namespace {

/// Views of one soup, whose textures do not vary: a colour depends only on the triangle and the view direction.
struct PlainScene : SmallScene {
  PlainScene(gpu::Device& device, std::vector<train::BatchView> batch)
      : SmallScene(device, 6, {{0, 0}}, std::move(batch)) {
    for (std::size_t i = 0; i < logits.size(); ++i) {
      const std::size_t triangle = i / 24, feature = i % 8;
      logits[i] = feature == 7 ? 6.0f : feature == 3 ? 3.0f : std::sin(float(7 * triangle + feature));
    }
    device.upload(soup.source.address(), logits);
    buffers.set_batch(views, soup.triangles, true);
    step.sum_textures();
    step.begin(1, 0, 0, {});
    step.visibility(train::Thresholds::half, inputs);
    step.shade(inputs);
    hits = device.download_vector<kernels::Hit>(buffers.hits.address(), buffers.batch().pixels);
    colours = device.download_vector<float>(buffers.colour.address(), 3ull * buffers.batch().pixels);
  }

  /// Largest difference of the channels of two pixels.
  double difference(std::size_t a, std::size_t b) const {
    double worst = 0;
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(double(colours[3 * a + c]) - colours[3 * b + c]));
    return worst;
  }

  std::vector<kernels::Hit> hits;
  std::vector<float> colours;
};

scene::Camera camera_at(glm::dvec3 eye) {
  scene::Camera camera;
  camera.world_to_camera[3] = glm::dvec4(-eye, 1.0);
  camera.width = camera.height = 8;
  camera.fx = camera.fy = 8;
  camera.cx = camera.cy = 4;
  return camera;
}

train::BatchView at(glm::dvec3 eye) { return train::batch_view(camera_at(eye), 0.025, 2.5); }

}  // namespace

TEST_CASE("a view shaded from another eye has the colours that this one sees", "[neighbour_eyes][each_driver]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kSide = 64, kPixels = kSide * kSide;
  const train::BatchView own = test::view_from(0.3, kSide, kSide), other = test::view_from(0.9, kSide, kSide);
  train::BatchView shifted = own;
  shifted.eye_shift = scene::eye(other.world_from_clip) - scene::eye(own.world_from_clip);
  const PlainScene s(*gpu, {own, shifted, other});

  int same = 0;
  double farthest = 0;
  for (std::uint32_t p = 0; p < kPixels; ++p) {
    if (s.hits[p].triangle == 0) continue;
    CHECK(s.hits[kPixels + p].triangle == s.hits[p].triangle);
    const glm::dvec2 ndc = 2.0 * (glm::dvec2(p % kSide, p / kSide) + 0.5) / double(kSide) - 1.0;
    const glm::dvec4 clip = other.clip_from_world * (own.world_from_clip * glm::dvec4(ndc, s.hits[p].depth, 1.0));
    const glm::dvec2 there = (glm::dvec2(clip) / clip.w + 1.0) * 0.5 * double(kSide) - 0.5;
    const glm::ivec2 nearest(glm::round(there));
    if (glm::any(glm::lessThan(nearest, glm::ivec2(0))) || glm::any(glm::greaterThanEqual(nearest, glm::ivec2(kSide))))
      continue;
    const std::uint32_t q = 2 * kPixels + std::uint32_t(nearest.y) * kSide + std::uint32_t(nearest.x);
    if (s.hits[q].triangle != s.hits[p].triangle || std::abs(s.hits[q].depth - clip.z / clip.w) > 1e-3) continue;
    ++same;
    CHECK(s.difference(kPixels + p, q) < 0.005);  // half a pixel turns the direction a little
    farthest = std::max(farthest, s.difference(p, q));
  }
  CHECK(same > 300);
  CHECK(farthest > 0.03);
  test::require_silence(*gpu);
}

TEST_CASE("the neighbours of a view are the two nearest eyes that are elsewhere", "[neighbour_eyes]") {
  const std::vector<train::BatchView> views{at({0, 0, 0}), at({0, 0, 0}), at({3, 0, 0}), at({1, 0, 0}), at({0, 2, 0})};
  const auto found = train::nearest_eyes(views);
  REQUIRE(found.size() == 5);
  CHECK(found[0] == train::Neighbours{3, 4});
  CHECK(found[1] == train::Neighbours{3, 4});
  CHECK(found[2] == train::Neighbours{3, 0});
  CHECK(found[3] == train::Neighbours{0, 1});
  CHECK(found[4] == train::Neighbours{0, 1});
  CHECK(train::nearest_eyes(std::vector{at({0, 0, 0}), at({0, 0, 0})})[1] == train::Neighbours{1, 1});
  CHECK(train::nearest_eyes(std::vector{at({0, 0, 0}), at({1, 0, 0})})[1] == train::Neighbours{0, 1});
}

TEST_CASE("a share of the views is seen from either neighbour", "[neighbour_eyes]") {
  constexpr train::Neighbours kBeside{8, 9};
  std::array<int, 10> count{};
  for (std::uint64_t step = 0; step < 1000; ++step)
    for (std::uint32_t view = 0; view < 5; ++view) {
      CHECK(train::seen_from(3, step, view, kBeside, 0) == view);
      const std::uint32_t eye = train::seen_from(3, step, view, kBeside, 0.3);
      REQUIRE((eye == view || eye == 8 || eye == 9));
      CHECK(eye == train::seen_from(3, step, view, kBeside, 0.3));
      CHECK(train::seen_from(3, step, view, kBeside, 1) != view);
      ++count[eye];
    }
  for (const int eye : {8, 9}) CHECK(std::abs(count[eye] / 5000.0 - 0.15) < 0.02);
  for (const int view : {0, 1, 2, 3, 4}) CHECK(std::abs(count[view] / 1000.0 - 0.7) < 0.06);
}

TEST_CASE("steps shade a share of their views from a neighbour", "[neighbour_eyes]") {
  auto gpu = test::open_device();
  scene::Scene scene;
  for (const double x : {0.0, 1.0, 3.0}) {
    scene::View view;
    view.camera = camera_at({x, 0, 0});
    view.image.width = view.image.height = 8;
    view.image.rgba.assign(8 * 8 * 4, 255);
    scene.train.push_back(view);
  }
  train::Settings settings = test::settings_of_recipe(train::Recipe::real);
  settings.batch = 3;
  const double share = GENERATE(0.0, 0.3, 1.0);
  settings.neighbour_directions = share;
  train::TrainingViews views(*gpu, scene, settings, 0);
  int moved = 0, all = 0;
  for (std::uint64_t step = 0; step < 300; ++step)
    for (const train::BatchView& view : views.batch(step)) {
      const double own = scene.train[view.index].camera.world_to_camera[3].x, shift = view.eye_shift.x;
      const auto is_eye = [&](double x) { return std::abs(-own + shift - x) < 1e-9; };
      CHECK((is_eye(0) || is_eye(1) || is_eye(3)));
      moved += std::abs(shift) > 0.5;
      ++all;
    }
  CHECK(std::abs(moved / double(all) - share) < 0.05);
}
