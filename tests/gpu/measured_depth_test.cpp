// Tests what measured depths do: points of a start (engine/scene/stereo/measured_planes.cpp), and training.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "args/view_depths.h"
#include "gpu/board_scene.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "scene/stereo/surface_points.h"
#include "train/quality/evaluate.h"

using namespace trisoup;

namespace {

/// Photographs that show nothing.
std::vector<scene::View> plain_photographs(int count) {
  std::vector<scene::View> views = test::photographs(count);
  for (scene::View& view : views)
    for (std::size_t i = 0; i < view.image.rgba.size(); ++i) view.image.rgba[i] = i % 4 == 3 ? 255 : 128;
  return views;
}

/// A map of half the size. times: factor of the true depths.
scene::MeasuredDepth map_of_view(const scene::View& view, double times = 1) {
  scene::MeasuredDepth depth{test::kBoardWidth / 2, test::kBoardHeight / 2, {}};
  const scene::Camera small = scene::resized(view.camera, depth.width, depth.height);
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x)
      depth.inverse.push_back(
          static_cast<float>(1 / (times * test::true_depth(view.camera.centre(), test::ray_of(small, x, y)))));
  return depth;
}

/// Share of points whose depth in the first view that sees them is off by more than a fiftieth.
double share_off(const scene::Points& points, const std::vector<scene::View>& views) {
  std::size_t off = 0;
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    const glm::dvec3 eye = views[points.seen_by[i].front()].camera.centre(), q = glm::dvec3(points.positions[i]) - eye;
    off += std::abs(q.z / test::true_depth(eye, q / q.z) - 1) > 0.02;
  }
  return static_cast<double>(off) / static_cast<double>(points.positions.size());
}

/// A wall of triangles across the views at one depth.
std::vector<glm::vec3> wall(double z) {
  std::vector<glm::vec3> triangles;
  constexpr int kCells = 14;
  const auto at = [&](int i, int j) { return glm::vec3(-1.6 + 3.2 * i / kCells, -1.2 + 2.4 * j / kCells, z); };
  for (int j = 0; j < kCells; ++j)
    for (int i = 0; i < kCells; ++i)
      for (const glm::vec3& corner :
           {at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)})
        triangles.push_back(corner);
  return triangles;
}

/// Median relative error of a model's depths in the views.
double depth_error(gpu::Device& gpu, const soup::Model& model, const std::vector<scene::View>& views) {
  train::LoadedModel loaded(gpu, model, {});
  std::vector<train::BatchView> batch;
  for (const scene::View& view : views) batch.push_back(train::batch_view(view.camera, 0.025, 10));
  std::vector<double> errors;
  train::for_each_batch(gpu, loaded.soup, loaded.buffers, batch, false, {}, 1, [&](std::size_t first, std::size_t) {
    const train::BatchLayout& b = loaded.buffers.batch();
    const gpu::Buffer depths = gpu.allocate(4ull * b.pixels, "depths");
    gpu.fill(loaded.buffers.target.address(), 4ull * b.pixels, 0xffffffffu);
    gpu.launch({"view_depths"}, b.blocks,
               kernels::ViewDepthsArgs{loaded.buffers.views.address(), loaded.buffers.hits.address(),
                                       loaded.soup.vertices.address(), loaded.buffers.target.address(),
                                       depths.address(), b.views, b.blocks});
    const auto found = gpu.download_vector<float>(depths.address(), b.pixels);
    for (int y = 0, i = 0; y < test::kBoardHeight; ++y)
      for (int x = 0; x < test::kBoardWidth; ++x, ++i) {
        const scene::Camera& camera = views[first].camera;
        errors.push_back(std::abs(
            double(found[std::size_t(i)]) / test::true_depth(camera.centre(), test::ray_of(camera, x, y)) - 1));
      }
  });
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2), errors.end());
  return errors[errors.size() / 2];
}

soup::Model trained(gpu::Device& gpu, const scene::Scene& scene, double lambda_depth) {
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  const std::vector<glm::vec3> start = wall(0.8);
  s.steps = 120;
  s.triangles = s.init_count = s.most_triangles = static_cast<std::uint32_t>(start.size() / 3);
  s.batch = 2;
  s.near = 0.025, s.far = 10;
  s.lr_vertex = 0.03;
  s.lr_vertex_end = 0.1;
  s.refine_every = 0;
  s.coarse_share = 0;
  s.level_min = s.level_max = 1;
  s.opaque = true;
  s.lambda_depth = lambda_depth;
  s.depth_until = 0.8;
  train::Trainer trainer(gpu, scene, s, start);
  trainer.run({});
  return trainer.model();
}

}  // namespace

TEST_CASE("measured depths give points where photographs show nothing", "[depth][trainer][same_code]") {
  auto gpu = test::open_device();
  std::vector<scene::View> views = plain_photographs(6);
  CHECK(scene::surface_points(*gpu, views, {}, 500).positions.empty());
  for (scene::View& view : views) view.depth = map_of_view(view);
  for (const std::uint64_t steps : {50, 500}) {  // without and with stereo
    const scene::Points points = scene::surface_points(*gpu, views, {}, steps);
    REQUIRE(points.positions.size() > 500);
    CHECK(points.measured == std::vector<bool>(points.positions.size(), true));
    CHECK(share_off(points, views) < 0.02);
  }
}

TEST_CASE("a measured point needs no second view, unless another view looks through it", "[depth]") {
  auto gpu = test::open_device();
  std::vector<scene::View> views = plain_photographs(6);
  views[4].depth = map_of_view(views[4], 0.5);
  const scene::Points alone = scene::surface_points(*gpu, views, {}, 50);
  REQUIRE(alone.positions.size() > 500);
  CHECK(alone.seen_by.front() == std::vector<std::uint32_t>{4});
  CHECK(share_off(alone, views) == 1);
  for (const std::size_t v : {0, 1, 2, 3, 5}) views[v].depth = map_of_view(views[v]);
  CHECK(share_off(scene::surface_points(*gpu, views, {}, 50), views) < 0.05);
}

TEST_CASE("a training with depth maps ends nearer to the true depths", "[depth][trainer][same_code]") {
  auto gpu = test::open_device();
  scene::Scene scene;
  scene.train = plain_photographs(6);
  const soup::Model without = trained(*gpu, scene, 1);
  for (scene::View& view : scene.train) view.depth = map_of_view(view);
  const double before = depth_error(*gpu, without, scene.train),
               after = depth_error(*gpu, trained(*gpu, scene, 1), scene.train);
  CAPTURE(before, after);
  CHECK(before > 0.15);
  CHECK(after < 0.08);
  // Without a weight the maps change no bit.
  CHECK(trained(*gpu, scene, 0).vertices == without.vertices);
}
