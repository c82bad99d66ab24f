// Tests corrections of poses on a device: measure_motion.comp, engine/train/step/camera_motion.h, pose_corrections.h,
// engine/train/quality/aligned_views.h, and trainings with poses that are off on purpose.
#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <vector>

#include "gpu/small_scene.h"
#include "ranks_of_threads.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "temporary_folder.h"
#include "train/quality/aligned_views.h"

using namespace trisoup;

namespace {

constexpr int kSide = 64;
constexpr double kHalf = 0.28;  // half the side of a cube around the origin

/// Colour of the cube along a ray; black beside it.
glm::dvec3 colour_along(const glm::dvec3& from, const glm::dvec3& direction) {
  double enter = -1e30, leave = 1e30;
  for (int axis = 0; axis < 3; ++axis) {
    double a = (-kHalf - from[axis]) / direction[axis], b = (kHalf - from[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a), leave = std::min(leave, b);
  }
  if (enter > leave) return glm::dvec3(0);
  const glm::dvec3 p = from + enter * direction;
  return {0.5 + 0.3 * std::sin(21 * p.x + 2) * std::cos(17 * p.y), 0.5 + 0.3 * std::sin(19 * p.y + 13 * p.z),
          0.5 + 0.3 * std::cos(23 * p.z - 11 * p.x)};
}

scene::View view_of_cube(double angle, double height) {
  scene::View v;
  v.name = "at " + std::to_string(angle);
  v.camera.width = v.camera.height = kSide;
  v.camera.fx = v.camera.fy = 1.1 * kSide;
  v.camera.cx = v.camera.cy = 0.5 * kSide;
  const glm::dvec3 centre = glm::normalize(glm::dvec3(std::cos(angle), std::sin(angle), height)), z = -centre,
                   x = glm::normalize(glm::cross(glm::dvec3(0, 0, -1), z)), y = glm::cross(z, x);
  v.camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(centre, 1)));
  v.image = {kSide, kSide, {}};
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      glm::dvec3 mean(0);
      for (int sample = 0; sample < 9; ++sample) {
        const double i = column + (sample % 3 + 0.5) / 3, j = row + (sample / 3 + 0.5) / 3;
        mean += colour_along(centre, (i - v.camera.cx) / v.camera.fx * x + (j - v.camera.cy) / v.camera.fy * y + z) / 9.0;
      }
      for (int c = 0; c < 3; ++c) v.image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255 * mean[c])));
      v.image.rgba.push_back(255);
    }
  return v;
}

struct CubeScene {
  scene::Scene scene;
  std::vector<scene::PoseChange> wrong;  // by which the training cameras are off
};

/// degrees, share: by which each training camera is turned and moved, in directions of its own.
CubeScene cube_scene(double degrees, double share) {
  CubeScene cube;
  soup::Random random(11);
  const auto direction = [&] {
    return glm::normalize(glm::dvec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  };
  for (int i = 0; i < 14; ++i) {
    cube.scene.train.push_back(view_of_cube(6.2831853 * i / 14, 0.2 + 0.3 * (i % 3)));
    cube.wrong.push_back({glm::radians(degrees) * direction(), share * direction()});
    scene::Camera& camera = cube.scene.train.back().camera;
    camera = scene::changed(camera, cube.wrong.back());
  }
  for (const double angle : {0.25, 2.1, 4.4}) cube.scene.test.push_back(view_of_cube(angle, 0.4));
  return cube;
}

/// The cube's faces, in small triangles.
std::vector<glm::vec3> cube_triangles() {
  constexpr int kParts = 5;
  std::vector<glm::vec3> triangles;
  for (int axis = 0; axis < 3; ++axis)
    for (const float side : {-1.0f, 1.0f})
      for (int i = 0; i < kParts * kParts; ++i) {
        const auto corner = [&](int dx, int dy) {
          glm::vec3 p(0);
          p[axis] = side;
          p[(axis + 1) % 3] = 2.0f * static_cast<float>(i % kParts + dx) / kParts - 1;
          p[(axis + 2) % 3] = 2.0f * static_cast<float>(i / kParts + dy) / kParts - 1;
          return float(kHalf) * p;
        };
        for (const glm::vec3& p : {corner(0, 0), corner(1, 0), corner(0, 1), corner(0, 1), corner(1, 0), corner(1, 1)})
          triangles.push_back(p);
      }
  return triangles;
}

train::Settings cube_settings(bool corrects, std::uint64_t steps = 160) {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.init = "surface";
  s.steps = steps;
  s.triangles = s.init_count = static_cast<std::uint32_t>(cube_triangles().size() / 3);
  s.refine_every = s.checkpoint_every = 0;
  s.coarse_share = 0;
  s.level_max = 3;
  s.lr_vertex = 2e-4;
  s.init_opacity = 0.9;
  s.pose_corrections = corrects;
  s.pose_motion = 0;
  s.pose_every = 4;
  return s;
}

/// Mean distance of corrected cameras from the true ones, but for a motion of the whole scene: radians and normalised
/// units.
double mean_error(const CubeScene& cube, const std::vector<scene::PoseChange>& corrections) {
  std::vector<scene::Camera> cameras;
  std::vector<scene::PoseChange> left = cube.wrong;
  for (std::size_t i = 0; i < left.size(); ++i) {
    cameras.push_back(cube.scene.train[i].camera);
    left[i].turn += corrections[i].turn;
    left[i].shift += corrections[i].shift;
  }
  double sum = 0;
  for (const scene::PoseChange& c : scene::without_common(cameras, left))
    sum += (glm::length(c.turn) + glm::length(c.shift)) / double(left.size());
  return sum;
}

}  // namespace

TEST_CASE("a camera is aligned with the picture that it should have taken", "[poses][each_driver]") {
  auto gpu = test::open_device();
  test::SmallScene s(*gpu, 60, {{0, 1}}, {test::view_from(0.2, 80, 60)});
  scene::View view;
  view.camera.width = 80, view.camera.height = 60;
  view.camera.fx = view.camera.fy = 96, view.camera.cx = 40, view.camera.cy = 30;
  const glm::dvec3 z(-std::cos(0.2), -std::sin(0.2), 0), y(0, 0, -1), x = glm::cross(y, z);
  const scene::Camera truth = [&] {
    scene::Camera c = view.camera;
    c.world_to_camera =
        glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1)));
    return c;
  }();
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, {});
  s.step.shade({});
  view.image = {80, 60, {}};
  const auto colours = gpu->download_vector<float>(s.buffers.colour.address(), 3 * 80 * 60);
  for (std::size_t i = 0; i < colours.size(); ++i) {
    view.image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(colours[i], 0.0f, 1.0f))));
    if (i % 3 == 2) view.image.rgba.push_back(255);
  }
  view.camera = truth;
  const auto error_after = [&](const scene::PoseChange& wrong, scene::View off) {
    off.camera = scene::changed(truth, wrong);
    const auto change = train::aligned_poses(*gpu, s.soup, s.buffers, {off}, glm::vec3(0), 0.025, 2.5)[0];
    return glm::length(wrong.turn + change.turn) + glm::length(wrong.shift + change.shift);
  };
  const scene::PoseChange wrong{{0.006, -0.004, 0.008}, {0.005, 0.006, -0.004}};
  const double before = glm::length(wrong.turn) + glm::length(wrong.shift);
  CHECK(error_after(wrong, view) < 0.25 * before);
  CHECK(error_after({}, view) < 0.05 * before);
  scene::View hidden = view;
  for (std::size_t i = 3; i < hidden.image.rgba.size(); i += 4) hidden.image.rgba[i] = 0;
  CHECK(error_after(wrong, hidden) == Approx(before));
  test::require_silence(*gpu);
}

TEST_CASE("poses that are off are found while the soup is learnt", "[poses][trainer]") {
  auto gpu = test::open_device();
  const CubeScene cube = cube_scene(0.5, 0.01);
  train::Trainer without(*gpu, cube.scene, cube_settings(false), cube_triangles()),
      with(*gpu, cube.scene, cube_settings(true), cube_triangles());
  without.run({});
  with.run({});
  REQUIRE(with.poses());
  const double before = mean_error(cube, std::vector<scene::PoseChange>(cube.wrong.size())),
               after = mean_error(cube, with.poses()->changes());
  CAPTURE(before, after);
  CHECK(after < 0.5 * before);
  const auto aligned_psnr = [&](train::Trainer& trainer) {
    return train::evaluate_aligned(*gpu, trainer.model(), cube.scene, 0.025, 2.5).evaluation.mean.psnr;
  };
  const double psnr_without = aligned_psnr(without), psnr_with = aligned_psnr(with);
  CAPTURE(psnr_without, psnr_with);
  CHECK(psnr_with > psnr_without + 1);
  const train::PoseReport report = train::report_of(cube.scene.train, with.poses()->changes());
  CHECK(report.median_degrees > 0.2);
  CHECK(report.largest_degrees < 1.5);
  CHECK(report.largest_shift < 0.03);
  CHECK_FALSE(report.worst.empty());
}

TEST_CASE("right poses are left alone", "[poses][trainer]") {
  auto gpu = test::open_device();
  const CubeScene cube = cube_scene(0, 0);
  train::Trainer without(*gpu, cube.scene, cube_settings(false), cube_triangles()),
      with(*gpu, cube.scene, cube_settings(true), cube_triangles());
  without.run({});
  with.run({});
  CHECK(mean_error(cube, with.poses()->changes()) < 0.0015);
  const double psnr_without = without.evaluate_float().mean.psnr, psnr_with = with.evaluate_float().mean.psnr;
  CAPTURE(psnr_without, psnr_with);
  CHECK(psnr_with > psnr_without - 0.2);
  // With a threshold they are not touched, and no bit differs.
  train::Settings careful = cube_settings(true);
  careful.pose_motion = 1;
  train::Trainer unused(*gpu, cube.scene, careful, cube_triangles());
  unused.run({});
  CHECK(unused.poses()->state() == train::PoseCorrections::State::unused);
  CHECK(unused.poses()->first_motion() > 0);
  CHECK((unused.model().lattice == without.model().lattice));
}

TEST_CASE("a resumed training with corrections gives the same bits", "[poses][trainer]") {
  auto gpu = test::open_device();
  const CubeScene cube = cube_scene(0.5, 0.01);
  const train::Settings settings = cube_settings(true, 24);
  train::Trainer whole(*gpu, cube.scene, settings, cube_triangles());
  whole.run({});
  test::TemporaryFolder folder;
  const auto path = folder.path() / "checkpoint.safetensors";
  {
    // Between two corrections, so that the sums count too.
    train::Trainer first(*gpu, cube.scene, settings, cube_triangles());
    std::atomic<bool> stop = false;
    train::Trainer::Callbacks callbacks;
    callbacks.stop = &stop;
    callbacks.progress_every = 10;
    callbacks.on_progress = [&](const train::Progress&) { stop = true; };
    first.run(callbacks);
    REQUIRE(first.step() == 10);
    first.write_checkpoint(path);
  }
  train::Trainer second(*gpu, cube.scene, settings, path);
  second.run({});
  CHECK(whole.poses()->values() == second.poses()->values());
  CHECK(glm::length(whole.poses()->changes()[0].turn) > 0);
  CHECK((whole.model().lattice == second.model().lattice));
  CHECK((whole.model().vertices == second.model().vertices));
}

TEST_CASE("several ranks correct poses as one does", "[poses][ranks][repeats]") {
  const CubeScene cube = cube_scene(0.5, 0.01);
  const auto values = [&](ranks::Ranks* ranks) {
    auto gpu = test::open_device();
    train::Trainer trainer(*gpu, cube.scene, cube_settings(true, 12), cube_triangles(), ranks);
    trainer.run({});
    return trainer.poses()->values();
  };
  const std::vector<double> expected = values(nullptr);
  std::vector<std::vector<double>> found(2);
  const auto thrown = test::run_as_ranks(
      2, [&](ranks::Ranks& ranks) { found[static_cast<std::size_t>(ranks.rank())] = values(&ranks); });
  CHECK(thrown == std::vector<std::string>(2));
  for (const auto& of_rank : found) CHECK(of_rank == expected);
}
