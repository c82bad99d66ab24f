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

constexpr int kRoomPixels = 64;
constexpr double kRoomHalf = 1;  // half the side of a room around the origin, in which the cameras are

/// Colour of the room's walls along a ray.
glm::dvec3 colour_along(const glm::dvec3& from, const glm::dvec3& direction) {
  double leave = 1e30;
  for (int axis = 0; axis < 3; ++axis) {
    const double wall = direction[axis] > 0 ? kRoomHalf : -kRoomHalf;
    if (direction[axis] != 0) leave = std::min(leave, (wall - from[axis]) / direction[axis]);
  }
  const glm::dvec3 p = from + leave * direction;
  return {0.5 + 0.3 * std::sin(17 * p.x + 2) * std::cos(15 * p.y), 0.5 + 0.3 * std::sin(14 * p.y + 13 * p.z),
          0.5 + 0.3 * std::cos(18 * p.z - 9 * p.x)};
}

scene::View view_of_room(double angle, double height) {
  scene::View v;
  v.name = "at " + std::to_string(angle);
  v.camera.width = v.camera.height = kRoomPixels;
  v.camera.fx = v.camera.fy = 0.6 * kRoomPixels;
  v.camera.cx = v.camera.cy = 0.5 * kRoomPixels;
  const glm::dvec3 centre = 0.7 * glm::normalize(glm::dvec3(std::cos(angle), std::sin(angle), height)),
                   z = -glm::normalize(centre), x = glm::normalize(glm::cross(glm::dvec3(0, 0, -1), z)),
                   y = glm::cross(z, x);
  v.camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(centre, 1)));
  v.image = {kRoomPixels, kRoomPixels, {}};
  for (int row = 0; row < kRoomPixels; ++row)
    for (int column = 0; column < kRoomPixels; ++column) {
      glm::dvec3 mean(0);
      for (int sample = 0; sample < 9; ++sample) {
        const double i = column + (sample % 3 + 0.5) / 3, j = row + (sample / 3 + 0.5) / 3;
        mean +=
            colour_along(centre, (i - v.camera.cx) / v.camera.fx * x + (j - v.camera.cy) / v.camera.fy * y + z) / 9.0;
      }
      for (int c = 0; c < 3; ++c) v.image.rgba.push_back(static_cast<std::uint8_t>(std::lround(255 * mean[c])));
      v.image.rgba.push_back(255);
    }
  return v;
}

struct RoomScene {
  scene::Scene scene;
  std::vector<scene::PoseChange> wrong;  // by which the training cameras are off
};

/// degrees, share: by which each training camera is turned and moved, in directions of its own.
RoomScene room_scene(double degrees, double share) {
  RoomScene room;
  soup::Random random(11);
  const auto direction = [&] {
    return glm::normalize(glm::dvec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  };
  for (int i = 0; i < 14; ++i) {
    room.scene.train.push_back(view_of_room(6.2831853 * i / 14, 0.2 + 0.3 * (i % 3)));
    room.wrong.push_back({glm::radians(degrees) * direction(), share * direction()});
    scene::Camera& camera = room.scene.train.back().camera;
    camera = scene::changed(camera, room.wrong.back());
  }
  for (const double angle : {0.25, 2.1, 4.4}) room.scene.test.push_back(view_of_room(angle, 0.4));
  return room;
}

/// The room's walls, in small triangles.
std::vector<glm::vec3> room_triangles() {
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
          return float(kRoomHalf) * p;
        };
        for (const glm::vec3& p : {corner(0, 0), corner(1, 0), corner(0, 1), corner(0, 1), corner(1, 0), corner(1, 1)})
          triangles.push_back(p);
      }
  return triangles;
}

train::Settings room_settings(bool corrects, std::uint64_t steps = 160) {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.init = "surface";
  s.steps = steps;
  s.triangles = s.init_count = static_cast<std::uint32_t>(room_triangles().size() / 3);
  s.refine_every = s.checkpoint_every = 0;
  s.coarse_share = 0;
  s.level_max = 3;
  s.lr_vertex = 2e-4;
  s.init_opacity = 0.9;
  s.far = 9;
  s.pose_corrections = corrects;
  s.pose_motion = 0;
  s.pose_every = 4;
  return s;
}

/// Mean distance of corrected cameras from the true ones, but for a motion of the whole scene: radians and normalised
/// units.
double mean_pose_error(const RoomScene& room, const std::vector<scene::PoseChange>& corrections) {
  std::vector<scene::Camera> cameras;
  std::vector<scene::PoseChange> left = room.wrong;
  for (std::size_t i = 0; i < left.size(); ++i) {
    cameras.push_back(room.scene.train[i].camera);
    left[i].turn += corrections[i].turn;
    left[i].shift += corrections[i].shift;
  }
  double sum = 0;
  for (const scene::PoseChange& c : scene::without_common(cameras, left))
    sum += (glm::length(c.turn) + glm::length(c.shift)) / double(left.size());
  return sum;
}

}  // namespace

TEST_CASE("a training from a surface begins with the exposures of its photographs", "[exposure][start]") {
  auto gpu = test::open_device();
  RoomScene room = room_scene(0, 0);
  for (std::size_t i = 0; i < room.scene.train.size(); ++i)
    for (std::size_t k = 0; k < room.scene.train[i].image.rgba.size(); ++k) {
      std::uint8_t& value = room.scene.train[i].image.rgba[k];
      const f64::Exposure exposure{glm::dvec3(i % 2 ? 0.4 : -0.4), 0};
      if (k % 4 != 3)
        value = static_cast<std::uint8_t>(std::lround(255 * f64::exposed(exposure, glm::dvec3(value / 255.0)).x));
    }
  train::Settings settings = room_settings(false);
  settings.exposure = true;
  train::Start start(room_triangles());
  start.colours.assign(start.vertices.size(), glm::vec3(0.5f));
  train::Trainer trainer(*gpu, room.scene, settings, start);
  const std::vector<soup::ExposureGrid> gains = trainer.exposures();
  REQUIRE(gains.size() == room.scene.train.size());
  for (std::size_t i = 0; i < gains.size(); ++i)
    for (const glm::vec3& gain : gains[i])
      for (int c = 0; c < 3; ++c) CHECK(gain[c] == Approx(i % 2 ? 0.4 : -0.4).margin(0.1));
  // A model that begins another training brings them along.
  const soup::Model model = trainer.model();
  REQUIRE(model.exposures.size() == gains.size());
  train::Trainer next(*gpu, room.scene, settings, model);
  for (std::size_t i = 0; i < gains.size(); ++i) CHECK(next.exposures()[i] == gains[i]);
  test::require_silence(*gpu);
}

TEST_CASE("a camera is aligned with the picture that it should have taken", "[poses][each_driver]") {
  auto gpu = test::open_device();
  train::SoupBuffers soup;
  train::BatchBuffers buffers(*gpu, 8);
  const std::vector<glm::vec3> vertices = room_triangles();
  const std::vector<soup::TextureLevels> levels(vertices.size() / 3, {1, 1});
  const soup::TextureTable table = soup::make_texture_table(levels);
  train::allocate_soup(*gpu, soup, vertices, table.entries);
  soup::Random random(7);
  std::vector<float> logits(table.source_samples * 8);
  for (std::size_t i = 0; i < logits.size(); ++i)  // the colours alone, opaque
    logits[i] = i % 8 < 3 ? static_cast<float>(random.uniform(-2, 2)) : i % 8 == 7 ? 9.0f : -9.0f;
  gpu->upload(soup.source.address(), logits);
  train::allocate_mlp(*gpu, soup, train::initial_mlp(1));
  scene::View view = view_of_room(0.3, 0.2);
  const scene::Camera truth = view.camera;
  buffers.set_batch(std::vector{train::batch_view(truth, 0.025, 9)}, soup.triangles, false);
  train::Step step(*gpu, soup, buffers);
  step.sum_textures();
  step.visibility(train::Thresholds::half, {});
  step.shade({});
  const auto colours = gpu->download_vector<float>(buffers.colour.address(), 3 * kRoomPixels * kRoomPixels);
  for (std::size_t i = 0; i < colours.size(); ++i)
    view.image.rgba[i / 3 * 4 + i % 3] =
        static_cast<std::uint8_t>(std::lround(255 * std::clamp(colours[i], 0.0f, 1.0f)));
  const auto error_after = [&](const scene::PoseChange& wrong, scene::View off) {
    off.camera = scene::changed(truth, wrong);
    const auto change = train::aligned_poses(*gpu, soup, buffers, {off}, glm::vec3(0), 0.025, 9)[0];
    return glm::length(wrong.turn + change.turn) + glm::length(wrong.shift + change.shift);
  };
  const scene::PoseChange wrong{{0.006, -0.004, 0.008}, {0.005, 0.006, -0.004}};
  const double before = glm::length(wrong.turn) + glm::length(wrong.shift);
  CHECK(error_after(wrong, view) < 0.2 * before);
  CHECK(error_after({}, view) < 0.02 * before);
  scene::View hidden = view;
  for (std::size_t i = 3; i < hidden.image.rgba.size(); i += 4) hidden.image.rgba[i] = 0;
  CHECK(error_after(wrong, hidden) == Approx(before));
  test::require_silence(*gpu);
}

TEST_CASE("poses that are off are found while the soup is learnt", "[poses][trainer][same_code]") {
  auto gpu = test::open_device();
  const RoomScene room = room_scene(0.5, 0.01);
  train::Trainer without(*gpu, room.scene, room_settings(false), room_triangles()),
      with(*gpu, room.scene, room_settings(true), room_triangles());
  without.run({});
  with.run({});
  REQUIRE(with.poses());
  const double before = mean_pose_error(room, std::vector<scene::PoseChange>(room.wrong.size())),
               after = mean_pose_error(room, with.poses()->changes());
  CAPTURE(before, after);
  CHECK(after < 0.5 * before);
  const auto aligned_psnr = [&](train::Trainer& trainer) {
    return train::evaluate_aligned(*gpu, trainer.model(), room.scene, 0.025, 9).evaluation.mean.psnr;
  };
  const double psnr_without = aligned_psnr(without), psnr_with = aligned_psnr(with);
  CAPTURE(psnr_without, psnr_with);
  CHECK(psnr_with > psnr_without + 1);
  const train::PoseReport report = train::report_of(room.scene.train, with.poses()->changes());
  CHECK(report.median_degrees > 0.2);
  CHECK(report.largest_degrees < 1.5);
  CHECK(report.largest_shift < 0.03);
  CHECK_FALSE(report.worst.empty());
}

TEST_CASE("right poses are left alone", "[poses][trainer][same_code]") {
  auto gpu = test::open_device();
  const RoomScene room = room_scene(0, 0);
  train::Trainer without(*gpu, room.scene, room_settings(false), room_triangles()),
      with(*gpu, room.scene, room_settings(true), room_triangles());
  without.run({});
  with.run({});
  CHECK(mean_pose_error(room, with.poses()->changes()) < 0.0015);
  const double psnr_without = without.evaluate_float().mean.psnr, psnr_with = with.evaluate_float().mean.psnr;
  CAPTURE(psnr_without, psnr_with);
  CHECK(psnr_with > psnr_without - 0.2);
  // With a threshold they are not touched, and no bit differs.
  train::Settings careful = room_settings(true);
  careful.pose_motion = 1;
  train::Trainer unused(*gpu, room.scene, careful, room_triangles());
  unused.run({});
  CHECK(unused.poses()->state() == train::PoseCorrections::State::unused);
  CHECK(unused.poses()->first_motion() > 0);
  CHECK((unused.model().lattice == without.model().lattice));
}

TEST_CASE("a resumed training with corrections gives the same bits", "[poses][trainer]") {
  auto gpu = test::open_device();
  const RoomScene room = room_scene(0.5, 0.01);
  const train::Settings settings = room_settings(true, 24);
  train::Trainer whole(*gpu, room.scene, settings, room_triangles());
  whole.run({});
  test::TemporaryFolder folder;
  const auto path = folder.path() / "checkpoint.safetensors";
  {
    // Between two corrections, so that the sums count too.
    train::Trainer first(*gpu, room.scene, settings, room_triangles());
    std::atomic<bool> stop = false;
    train::Trainer::Callbacks callbacks;
    callbacks.stop = &stop;
    callbacks.progress_every = 10;
    callbacks.on_progress = [&](const train::Progress&) { stop = true; };
    first.run(callbacks);
    REQUIRE(first.step() == 10);
    first.write_checkpoint(path);
  }
  train::Trainer second(*gpu, room.scene, settings, path);
  second.run({});
  CHECK(whole.poses()->values() == second.poses()->values());
  CHECK(glm::length(whole.poses()->changes()[0].turn) > 0);
  CHECK((whole.model().lattice == second.model().lattice));
  CHECK((whole.model().vertices == second.model().vertices));
}

TEST_CASE("several ranks correct poses as one does", "[poses][ranks][repeats]") {
  const RoomScene room = room_scene(0.5, 0.01);
  const auto values = [&](ranks::Ranks* ranks) {
    auto gpu = test::open_own_device();
    train::Trainer trainer(*gpu, room.scene, room_settings(true, 12), room_triangles(), ranks);
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
