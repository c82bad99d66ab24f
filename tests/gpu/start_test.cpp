// Tests engine/train/start/painting.h and engine/train/topology/hole_guard.h on a device: renderings before the first
// step, and that covered pixels stay covered.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "train/step/photographs.h"
#include "train/topology/hole_guard.h"
#include "train/topology/refine.h"

using namespace trisoup;
using test::SmallScene;

namespace {

/// A view from x = 1 towards the origin with smooth colours. A square of another colour is masked.
scene::View smooth_view() {
  constexpr int kSide = 64;
  scene::View v;
  v.name = "smooth";
  v.camera.width = v.camera.height = kSide;
  v.camera.fx = v.camera.fy = 1.25 * kSide;
  v.camera.cx = v.camera.cy = 0.5 * kSide;
  v.camera.world_to_camera = glm::inverse(
      glm::dmat4(glm::dvec4(0, 1, 0, 0), glm::dvec4(0, 0, -1, 0), glm::dvec4(-1, 0, 0, 0), glm::dvec4(1, 0, 0, 1)));
  v.image = {kSide, kSide, {}};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double colour[3] = {0.2 + 0.6 * x / kSide, 0.5 + 0.3 * std::sin(0.2 * y),
                                0.5 + 0.3 * std::cos(0.15 * (x + y))};
      const bool masked = std::abs(x - 40) < 8 && std::abs(y - 20) < 8;
      for (const double c : colour)
        v.image.rgba.push_back(masked ? 255 : static_cast<std::uint8_t>(std::lround(255 * c)));
      v.image.rgba.push_back(masked ? 0 : 255);
    }
  return v;
}

}  // namespace

TEST_CASE("a painted start matches the photographs before the first step", "[start]") {
  auto gpu = test::open_device();
  scene::Scene scene;
  scene.train = scene.test = {smooth_view()};
  train::Settings settings = test::settings_of_recipe(train::Recipe::real);
  settings.triangles = settings.init_count = 2;
  settings.near = settings.test_near = 0.025;
  settings.far = 10;
  settings.init_opacity = 0.9;
  settings.coarse_share = 0;
  settings.level_min = GENERATE(0u, 2u);
  settings.level_max = 4;
  settings.samples_per_pixel = GENERATE(0.0, 1.0);
  constexpr float h = 0.42f;  // fills the image
  train::Start square(std::vector<glm::vec3>{{0, -h, -h}, {0, h, -h}, {0, h, h}, {0, -h, -h}, {0, h, h}, {0, -h, h}});
  square.colours.assign(6, glm::vec3(0.3f, 0.4f, 0.6f));
  const auto psnr = [&](bool paint) {
    settings.init = paint ? "surface" : "points";
    train::Trainer trainer(*gpu, scene, settings, square);
    float white = 0;
    const double psnr = trainer
                            .evaluate_float([&](const scene::View&, const std::vector<float>& colour) {
                              white = colour[3 * (20 * 64 + 40)];
                            })
                            .mean.psnr;
    CHECK(white < 0.8f);  // masked pixels have no influence
    return psnr;
  };
  CHECK(psnr(false) < 18);
  CHECK(psnr(true) > 29);
  test::require_silence(*gpu);
}

TEST_CASE("painted textures are means over the pixels of the samples of each level", "[start][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(3);
  std::vector<train::BatchView> views{test::view_from(0.4, 61, 47), test::view_from(2.5, 40, 40)};
  std::vector<Image> images;
  for (const train::BatchView& view : views) {
    images.push_back({static_cast<int>(view.width), static_cast<int>(view.height), {}});
    for (std::uint32_t i = 0; i < 4 * view.width * view.height; ++i)
      images.back().rgba.push_back(
          static_cast<std::uint8_t>(i % 4 == 3 ? (i % 44 == 3 ? 0 : 255) : 30 + 200 * random.uniform01()));
  }
  const train::Photographs photographs = train::upload_photographs(*gpu, images);
  for (std::uint32_t v = 0; v < 2; ++v) views[v].photo = photographs.addresses[v], views[v].index = v;
  SmallScene s(*gpu, 14, {{0, 0}}, views);
  train::Settings settings;
  settings.samples_per_pixel = 0;
  settings.level_min = GENERATE(0u, 2u);
  settings.level_max = 4;

  // Computes the same values in double, with separate sums for each level.
  const std::vector<soup::TextureEntry> table =
      soup::make_texture_table(14, {settings.level_min, settings.level_max}).entries;
  std::vector<glm::dvec4> sums(train::source_samples(table), glm::dvec4(0.0));
  gpu->fill(s.soup.opacity.address(), s.soup.opacity.bytes(), 0x3f800000u);
  train::for_each_batch(*gpu, s.soup, s.buffers, views, false, {}, 1, [&](std::size_t view, std::size_t) {
    const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
    for (std::size_t p = 0; p < hits.size(); ++p) {
      const std::uint8_t* rgba = &images[view].rgba[4 * p];
      if (hits[p].triangle == 0 || rgba[3] < 128) continue;
      const soup::TextureEntry& row = table[hits[p].triangle - 1];
      std::size_t base = row.source_offset;
      for (std::uint32_t level = row.level_min; level <= row.level_max; base += soup::samples_at(level++)) {
        const f64::LatticeCell cell = f64::lattice_cell(hits[p].b0, hits[p].b1, level);
        const glm::dvec4 colour(rgba[0] / 255.0, rgba[1] / 255.0, rgba[2] / 255.0, 1);
        sums[base + cell.i0] += cell.w0 * colour, sums[base + cell.i1] += cell.w1 * colour,
            sums[base + cell.i2] += cell.w2 * colour;
      }
    }
  });
  std::vector<double> expected(8 * sums.size());
  const auto logit_of = [](double c) { return std::log(std::clamp(c, 0.02, 0.98) / (1 - std::clamp(c, 0.02, 0.98))); };
  const auto sigmoid = [](double x) { return 1 / (1 + std::exp(-x)); };
  double most_seen = 0;
  for (std::uint32_t t = 0; t < 14; ++t)
    for (int c = 0; c < 3; ++c) {
      const auto corner = [&](std::uint32_t i, int channel) {
        return double(s.logits[8 * (s.soup.table[t].source_offset + i) + channel]);
      };
      std::vector<double> colours{sigmoid(corner(0, c)), sigmoid(corner(1, c)), sigmoid(corner(2, c))}, shown;
      std::uint32_t coarser = 0;
      std::size_t base = table[t].source_offset;
      for (std::uint32_t level = settings.level_min; level <= settings.level_max; ++level) {
        std::vector<double> finer, logits;
        for (std::uint32_t i = 0; i < soup::samples_at(level); ++i) {
          std::uint32_t x = 0, y = 0;
          f64::lattice_point(i, x, y);
          const f64::LatticeCell cell = f64::lattice_cell(x / double(1u << level), y / double(1u << level), coarser);
          const auto mix = [&](const std::vector<double>& v) {
            return cell.w0 * v[cell.i0] + cell.w1 * v[cell.i1] + cell.w2 * v[cell.i2];
          };
          const glm::dvec4& sum = sums[base + i];
          finer.push_back((sum[c] + 0.5 * mix(colours)) / (sum.w + 0.5));
          logits.push_back(logit_of(finer.back()));
          double* to = &expected[8 * (base + i)];
          to[c] = logits.back() - (shown.empty() ? 0 : mix(shown));
          if (shown.empty()) to[3] = -3, to[7] = corner(0, 7);
          most_seen = std::max(most_seen, sum.w);
        }
        base += soup::samples_at(level);
        colours = std::move(finer), shown = std::move(logits), coarser = level;
      }
    }
  REQUIRE(most_seen > 10);
  train::paint(*gpu, s.soup, s.buffers, {views, views}, nullptr, settings);
  const auto painted = gpu->download_vector<float>(s.soup.source.address(), expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) worst = std::max(worst, std::abs(painted[i] - expected[i]));
  CHECK(worst < 2e-5);
  test::require_silence(*gpu);
}

TEST_CASE("the hole guard keeps triangles whose removal would open a hole", "[start][each_driver]") {
  auto gpu = test::open_device();
  // Seen from the camera at x = 1: triangle 0, triangle 1 behind it, and triangle 2 as backdrop.
  SmallScene s(*gpu, 3, {{0, 0}}, {test::view_from(0, 16, 16), test::view_from(0.2, 9, 13)});
  std::vector<glm::vec3> vertices;
  for (const float x : {0.2f, 0.0f, -0.5f}) vertices.insert(vertices.end(), {{x, -9, -9}, {x, 9, -9}, {x, 0, 18}});
  gpu->upload(s.soup.vertices.address(), vertices);
  for (std::size_t i = 7; i < s.logits.size(); i += 8) s.logits[i] = 30;
  gpu->upload(s.soup.source.address(), s.logits);
  s.step.sum_textures();
  const auto before = gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples);
  const auto plugged = [&](std::vector<std::uint32_t> kept, std::vector<bool> backdrop, std::size_t most) {
    train::guard_holes(*gpu, s.soup, s.buffers, s.views, backdrop, most, kept);
    return kept;
  };
  using List = std::vector<std::uint32_t>;
  CHECK(plugged({1, 2}, {false, false, true}, 3) == List{1, 2});  // triangle 1 covers the pixels
  // Without both triangles the backdrop would show. Triangle 1 was never visible, so triangle 0 is kept.
  CHECK(plugged({2}, {false, false, true}, 3) == List{0, 2});
  CHECK(plugged({2}, {false, false, false}, 3) == List{2});  // triangle 2 is not a backdrop, so it covers the pixels
  CHECK(plugged({1}, {false, false, true}, 3) == List{1});   // the backdrop is hidden and not needed
  CHECK(plugged({}, {false, false, false}, 3) == List{0});   // without it no triangle would be visible
  CHECK(plugged({2}, {false, false, true}, 1) == List{2});   // the limit of triangles is reached
  CHECK(gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples) == before);
  test::require_silence(*gpu);
}
