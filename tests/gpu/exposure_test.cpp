// Tests exposures of photographs on a device: engine/train/step/exposure.h, shaders/measure_exposure.comp,
// fit_exposure.comp, expose.comp, their gradients in shade_backward.comp, those of the start, and trainings.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "temporary_folder.h"
#include "train/quality/view_exposures.h"
#include "train/start/painting.h"
#include "train/start/random_start.h"
#include "train/start/start_exposures.h"

using namespace trisoup;
using test::SmallScene;

namespace {

glm::vec3 colour_of(std::uint32_t rgba) {
  return glm::vec3(rgba & 255u, (rgba >> 8) & 255u, (rgba >> 16) & 255u) / 255.0f;
}

glm::vec3 at(const std::vector<float>& colours, std::size_t pixel) {
  return {colours[3 * pixel], colours[3 * pixel + 1], colours[3 * pixel + 2]};
}

f32::Exposure row(const std::vector<glm::vec4>& table, std::size_t i) { return {glm::vec3(table[i]), table[i].w}; }

/// A batch of photographs. photographs: number of all photographs; the batch contains those with the views' indices.
struct ExposedScene : SmallScene {
  ExposedScene(gpu::Device& device, std::vector<train::BatchView> batch,
               const std::vector<std::vector<std::uint32_t>>& images, std::uint32_t photographs)
      : SmallScene(device, 40, {{0, 3}}, batch),
        exposures(train::allocate_exposures(device, photographs, static_cast<std::uint32_t>(batch.size()))) {
    for (std::size_t i = 0; i < batch.size(); ++i) {
      uploads.push_back(gpu.allocate(images[i].size() * 4, "photograph"));
      gpu.upload(uploads.back().address(), images[i]);
      views[i].photo = uploads.back().address();
    }
    buffers.set_batch(views, soup.triangles, true);
    inputs.target = 0;
    inputs.exposures = &exposures;
  }

  void render() {
    step.sum_textures();
    step.begin(1, 0, 0, {});
    step.visibility(train::Thresholds::half, inputs);
    step.shade(inputs);
  }
  std::vector<float> colours() {
    return gpu.download_vector<float>(buffers.colour.address(), 3ull * buffers.batch().pixels);
  }
  std::vector<glm::vec4> table(const gpu::Buffer& buffer) {
    return gpu.download_vector<glm::vec4>(buffer.address(), std::size_t{exposures.photographs} * EXPOSURE_PLACES);
  }

  train::Exposures exposures;
  std::vector<gpu::Buffer> uploads;
};

std::vector<std::uint32_t> noise(std::uint32_t pixels, std::uint64_t seed) {
  soup::Random random(seed);
  std::vector<std::uint32_t> photograph(pixels);
  for (std::uint32_t& p : photograph) p = random.bits() | (random.uniform01() < 0.1 ? 0u : 0xff000000u);
  return photograph;
}

train::BatchView view_of(std::uint32_t index, double angle, std::uint32_t width, std::uint32_t height) {
  train::BatchView view = test::view_from(angle, width, height);
  view.index = index;
  return view;
}

/// Returns a view of a column at the origin from `angle`. Its colours are the same in all views, exposed with a gain.
/// falloff: what is added to the gain at the picture's left and right sides, quadratic between.
scene::View square_view(double angle, const glm::vec3& gain, float falloff = 0) {
  constexpr int kSide = 64;  // 16 pixels between places
  scene::View v;
  v.name = std::to_string(angle);
  v.camera.width = v.camera.height = kSide;
  v.camera.fx = v.camera.fy = 1.25 * kSide;
  v.camera.cx = v.camera.cy = 0.5 * kSide;
  const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
  v.camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1)));
  v.image = {kSide, kSide, {}};
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      const bool inside = std::abs(row - kSide / 2) < kSide / 4 && std::abs(column - kSide / 2) < kSide / 4;
      const float height = static_cast<float>(row) / kSide;
      const glm::vec3 colour(0.25f + 0.3f * height, 0.5f, row > kSide / 2 ? 0.3f : 0.55f);
      const float side = 2 * (static_cast<float>(column) + 0.5f) / kSide - 1;
      const glm::vec3 shown = f32::exposed({gain + falloff * side * side, 0}, colour);
      for (int c = 0; c < 3; ++c)
        v.image.rgba.push_back(inside ? static_cast<std::uint8_t>(std::lround(255.0f * shown[c])) : 0);
      v.image.rgba.push_back(255);
    }
  return v;
}

/// Returns a ring of photographs. tinted: each training photograph has its own gains; their mean is 0.
scene::Scene ring_scene(bool tinted) {
  scene::Scene scene;
  constexpr int kViews = 12;
  for (int i = 0; i < kViews; ++i) {
    const float angle = 6.2831853f * static_cast<float>(i) / kViews;
    const float odd = i % 2 ? 1.0f : -1.0f, half = i % 4 < 2 ? 1.0f : -1.0f;
    const glm::vec3 gain = tinted ? glm::vec3(0.9f * odd, 0.7f * odd, 0.8f * half) : glm::vec3(0);
    scene.train.push_back(square_view(angle, gain));
  }
  for (const double angle : {0.3, 1.9, 4.0}) scene.test.push_back(square_view(angle, glm::vec3(0)));
  scene.synthetic = true;
  return scene;
}

train::Settings ring_settings(std::uint64_t steps, bool exposure) {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.steps = steps;
  s.triangles = s.init_count = 150;
  s.init_radius = 0.1;
  s.refine_every = 40;
  s.checkpoint_every = 0;
  s.level_max = 3;
  s.lr_vertex = 2e-3;
  s.exposure = exposure;
  return s;
}

/// What the photographs of a photograph's camera have in common (shaders/fit_exposure.comp), on the host.
struct Common {
  glm::vec3 mean{0};
  std::array<glm::vec3, EXPOSURE_PLACES> gain{};
  float share = 0, own_share = 0;
};

Common common_of(const std::vector<glm::vec4>& table, const std::vector<glm::vec4>& start,
                 const std::vector<std::uint32_t>& cameras, std::size_t photograph, bool without_it) {
  Common common;
  const auto beyond = [&](std::size_t p, std::size_t k) {
    return glm::vec3(table[p * EXPOSURE_PLACES + k] - start[p * EXPOSURE_PLACES + k]);
  };
  std::vector<std::size_t> its;
  for (std::size_t p = 0; p < cameras.size(); ++p) {
    for (std::size_t k = 0; k < EXPOSURE_PLACES; ++k) common.mean += beyond(p, k) / float(table.size());
    if (cameras[p] == cameras[photograph] && !(without_it && p == photograph)) its.push_back(p);
  }
  if (its.empty()) return common;
  const float one = 1.0f / float(its.size() * EXPOSURE_PLACES);
  float variance = 0, within = 0, between = 0;
  for (std::size_t k = 0; k < EXPOSURE_PLACES; ++k) {
    for (const std::size_t p : its) common.gain[k] += (beyond(p, k) - common.mean) / float(its.size());
    for (const std::size_t p : its) {
      const glm::vec3 rest = beyond(p, k) - common.mean - common.gain[k];
      within += one * glm::dot(rest, rest) / 3;
      variance += one * table[p * EXPOSURE_PLACES + k].w;
    }
    between += glm::dot(common.gain[k], common.gain[k]) / (3 * float(EXPOSURE_PLACES));
  }
  common.share = f32::exposure_share(between, variance / float(its.size()));
  common.own_share = f32::exposure_share(within, variance);
  return common;
}

std::vector<glm::vec3> ring_start(const train::Settings& s) {
  return soup::triangles_in_box(s.init_count, glm::vec3(-0.25f), glm::vec3(0.25f), s.init_radius, 3);
}

}  // namespace

TEST_CASE("exposures of a batch match a fit on the host to the same pixels", "[exposure][each_driver]") {
  auto gpu = test::open_device();
  // Photograph 3 is in the batch twice. Photographs 0, 2 and 4 are not in it. Photograph 1 is its camera's only one.
  ExposedScene s(*gpu, {view_of(3, 0.2, 40, 30), view_of(1, 2.0, 33, 47), view_of(3, 0.9, 21, 50)},
                 {noise(1200, 1), noise(1551, 2), noise(1050, 3)}, 5);
  constexpr std::size_t kRows = 5 * EXPOSURE_PLACES;
  const std::vector<std::uint32_t> cameras{0, 1, 0, 0, 2};
  gpu->upload(s.exposures.cameras.address(), cameras);
  std::vector<glm::vec4> before, start;
  for (int i = 0; i < 5; ++i)
    for (int k = 0; k < int(EXPOSURE_PLACES); ++k) {
      before.emplace_back(-1.0f + 0.7f * i + 0.02f * k, 0.5f - 0.02f * k, 1.2f - 0.6f * i + 0.03f * (k % 5), 0);
      start.emplace_back(0.1f * i, 0.2f, -0.1f * i + 0.01f * k, 0);
    }
  gpu->upload(s.exposures.start.address(), start);
  gpu->upload(s.exposures.fitted.address(), before);
  gpu->upload(s.exposures.exposure.address(), before);
  s.render();
  const std::vector<float> rendered = s.colours();
  const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
  s.step.loss(s.inputs);
  const std::vector<float> shown = s.colours();
  const auto target = gpu->download_vector<std::uint32_t>(s.buffers.target.address(), s.buffers.batch().pixels);
  const auto fitted = s.table(s.exposures.fitted), exposure = s.table(s.exposures.exposure);

  std::vector<std::array<glm::vec4, EXPOSURE_SUMS>> sums(kRows);
  std::vector<float> pixels(5);
  std::size_t seen = 0;
  const auto& records = s.buffers.batch().records;
  for (const kernels::ViewRecord& v : records) pixels[v.index] += float(v.width * v.height);
  for (const kernels::ViewRecord& v : records)
    for (std::uint32_t pixel = 0; pixel < v.width * v.height; ++pixel) {
      const std::size_t p = v.pixel_offset + pixel;
      if (hits[p].triangle == 0) {
        CHECK(at(shown, p) == at(rendered, p));
        continue;
      }
      ++seen;
      const std::uint32_t x = pixel % v.width, y = pixel / v.width;
      const glm::vec2 here = (glm::vec2(x, y) + 0.5f) / glm::vec2(v.width, v.height);
      const auto gain_at = [&](const std::vector<glm::vec4>& table, std::uint32_t square) {
        const glm::vec4 weights = f32::exposure_weights(here.x, here.y, square);
        f32::Exposure sum{glm::vec3(0), 0};
        for (std::uint32_t k = 0; k < 4; ++k)
          sum.gain += weights[int(k)] * glm::vec3(table[v.index * EXPOSURE_PLACES + f32::exposure_corner(square, k)]);
        return sum;
      };
      const glm::vec3 colour = f32::exposed(gain_at(exposure, f32::exposure_square(here.x, here.y)), at(rendered, p));
      for (int c = 0; c < 3; ++c) CHECK(at(shown, p)[c] == Approx(colour[c]).margin(1e-5));
      if (!f32::in_mask(target[p])) continue;
      const std::uint32_t square = f32::exposure_square(here.x, here.y);
      glm::vec4 one[EXPOSURE_SUMS]{};
      f32::add_to_exposure(at(rendered, p), colour_of(target[p]), gain_at(before, square), one);
      const glm::vec4 weights = f32::exposure_weights(here.x, here.y, square);
      for (std::uint32_t k = 0; k < 4; ++k)
        for (std::size_t i = 0; i < EXPOSURE_SUMS; ++i)
          sums[v.index * EXPOSURE_PLACES + f32::exposure_corner(square, k)][i] += weights[int(k)] * one[i];
    }
  CHECK(seen > 500);
  std::vector<glm::vec4> so_far = before;
  for (const std::size_t photograph : {3, 1}) {
    const Common others = common_of(so_far, start, cameras, photograph, true);
    for (std::size_t k = 0; k < EXPOSURE_PLACES; ++k) {
      const std::size_t i = photograph * EXPOSURE_PLACES + k;
      const f32::Exposure expected = f32::fitted_exposure(
          sums[i].data(), row(before, i), row(start, i).gain + others.share * (others.mean + others.gain[k]),
          sums[i][0].w * 16 / pixels[photograph]);
      for (int c = 0; c < 3; ++c) CHECK(fitted[i][c] == Approx(expected.gain[c]).margin(1e-4));
      CHECK(fitted[i].w == Approx(expected.variance).epsilon(1e-3));
      so_far[i] = fitted[i];
    }
    const Common common = common_of(so_far, start, cameras, photograph, false);
    CAPTURE(common.share, common.own_share);
    if (photograph == 1) CHECK(common.own_share == 0);
    for (const float share : {common.share, common.own_share})
      CHECK((photograph == 1 || (share > 0.1f && share < 0.98f)));
    for (std::size_t k = 0; k < EXPOSURE_PLACES; ++k) {
      const std::size_t i = photograph * EXPOSURE_PLACES + k;
      const glm::vec3 first = row(start, i).gain, own = row(fitted, i).gain - first - common.mean - common.gain[k],
                      expected = first + common.share * common.gain[k] + common.own_share * own;
      for (int c = 0; c < 3; ++c) CHECK(exposure[i][c] == Approx(expected[c]).margin(1e-4));
    }
  }
  CHECK(fitted == so_far);
  for (const std::size_t photograph : {0, 2, 4})
    for (std::size_t i = photograph * EXPOSURE_PLACES; i < (photograph + 1) * EXPOSURE_PLACES; ++i)
      CHECK(exposure[i] == before[i]);
  test::require_silence(*gpu);
}

TEST_CASE("a step that must be repeated changes no exposure and does not affect the next step", "[exposure]") {
  auto gpu = test::open_device();
  ExposedScene s(*gpu, {view_of(0, 0.2, 40, 30), view_of(1, 2.0, 33, 47)}, {noise(1200, 1), noise(1551, 2)}, 2);
  const auto fitted_after = [&](bool overflow_first) {
    gpu->upload(s.exposures.fitted.address(), std::vector<glm::vec4>(2 * EXPOSURE_PLACES));
    gpu->upload(s.exposures.exposure.address(), std::vector<glm::vec4>(2 * EXPOSURE_PLACES));
    for (const bool overflow : {true, false}) {
      if (overflow && !overflow_first) continue;
      s.render();
      kernels::Control control{};
      control.overflow = overflow;
      gpu->upload(s.buffers.control.address(), std::as_bytes(std::span(&control, 1)));
      s.step.loss(s.inputs);
      if (!overflow) continue;
      CHECK(s.table(s.exposures.fitted)[0] == glm::vec4(0));
      CHECK(s.table(s.exposures.exposure)[0] == glm::vec4(0));
    }
    return s.table(s.exposures.fitted);
  };
  const auto once = fitted_after(false), again = fitted_after(true);
  CHECK(once == again);
  CHECK(once[0] != glm::vec4(0));
  test::require_silence(*gpu);
}

TEST_CASE("texture gradients through an exposure match finite differences of the loss", "[exposure]") {
  auto gpu = test::open_device();
  // All exposed colours are above their target in the first photograph and below it in the second. So no colour crosses
  // its target, where the L1 error has a kink.
  soup::Random random(8);
  std::vector<std::uint32_t> dark(1600), bright(1600);
  for (std::size_t i = 0; i < dark.size(); ++i) {
    dark[i] = bright[i] = 0xff000000u;
    for (int c = 0; c < 3; ++c) {
      dark[i] |= (random.bits() % 30) << (8 * c);
      bright[i] |= (225u + random.bits() % 30) << (8 * c);
    }
  }
  ExposedScene s(*gpu, {view_of(0, 0, 40, 40), view_of(1, 1, 40, 40)}, {dark, bright}, 2);
  s.inputs.fit_exposures = false;
  std::vector<glm::vec4> gains;
  for (int k = 0; k < 2 * int(EXPOSURE_PLACES); ++k) {
    const float more = 0.015f * float(k % int(EXPOSURE_PLACES));
    gains.push_back(k < int(EXPOSURE_PLACES) ? glm::vec4(0.6 + more, 0.9 - more, 0.7, 0)
                                             : glm::vec4(-0.5 - more, -0.9 + more, -0.6, 0));
  }
  gpu->upload(s.exposures.exposure.address(), gains);
  s.buffers.reserve_lists(1 << 16);
  const gpu::Buffer gradient = gpu->allocate(s.soup.source_samples * 32, "gradient");
  s.inputs.probes.source_gradient = gradient.address();
  const auto loss = [&] {
    s.render();
    s.step.loss(s.inputs);
    const auto r = gpu->download_vector<kernels::Statistics>(s.buffers.statistics.address(), 1)[0];
    return 0.8 * train::fixed_sum(r.l1_low, r.l1_high) + 0.1 * (1 - train::fixed_sum(r.ssim_low, r.ssim_high));
  };
  loss();
  s.step.backward(s.inputs);
  s.step.update(s.inputs);  // learning rates are 0
  const auto texture = gpu->download_vector<float>(gradient.address(), s.soup.source_samples * 8);
  double ab = 0, bb = 0, aa = 0;
  for (int c = 0; c < 7; ++c) {
    std::size_t best = c;
    for (std::size_t i = c; i < texture.size(); i += 8)
      if (std::abs(texture[i]) > std::abs(texture[best])) best = i;
    const auto at = [&](float value) {
      gpu->upload(s.soup.source.address() + 4 * best, std::as_bytes(std::span(&value, 1)));
      return loss();
    };
    constexpr float h = 0.05f;
    const double expected = (at(s.logits[best] + h) - at(s.logits[best] - h)) / (2.0 * h), actual = texture[best];
    at(s.logits[best]);
    ab += actual * expected, bb += expected * expected, aa += actual * actual;
    CHECK(actual == Approx(expected).epsilon(0.1).margin(0.02 * std::sqrt(bb)));
  }
  CHECK(ab / bb == Approx(1).margin(0.03));
  CHECK(ab / std::sqrt(aa * bb) > 0.999);
  test::require_silence(*gpu);
}

TEST_CASE("exposures of the start are those of the photographs of a surface, and it is painted without them",
          "[exposure][start][each_driver]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views;
  for (std::uint32_t i = 0; i < 8; ++i) views.push_back(view_of(i, 0.7 * i, 48, 40));
  SmallScene s(*gpu, 40, {{0, 0}}, views);
  s.step.sum_textures();
  // Every place has a colour of its own, which each photograph shows in its exposure. One part of them is clipped.
  const auto gain_of = [](std::size_t view) {
    const auto x = static_cast<float>(view);
    return glm::vec3(0.5f * std::sin(x), view == 3 ? -0.7f : 0.1f, 0.3f * std::cos(3 * x));
  };
  const auto colour_at = [](std::uint32_t triangle) {
    soup::Random r(triangle);
    return glm::vec3(r.uniform(0.3, 0.7), r.uniform(0.3, 0.7), r.uniform(0.3, 0.7));
  };
  std::vector<Image> photographs(views.size());
  std::vector<gpu::Buffer> uploads;
  train::for_each_batch(*gpu, s.soup, s.buffers, views, false, {}, 1, [&](std::size_t v, std::size_t) {
    const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
    Image& image = photographs[v];
    image = {48, 40, {}};
    for (std::size_t p = 0; p < hits.size(); ++p) {
      const glm::vec3 shown = f32::exposed({gain_of(v), 0}, colour_at(hits[p].triangle));
      const bool clipped = hits[p].triangle % 5 == 0;
      for (int c = 0; c < 3; ++c)
        image.rgba.push_back(clipped ? std::uint8_t(255) : static_cast<std::uint8_t>(std::lround(255 * shown[c])));
      image.rgba.push_back(255);
    }
    uploads.push_back(gpu->allocate(image.rgba.size(), "photograph"));
    gpu->upload(uploads.back().address(), image.rgba);
  });
  for (std::size_t v = 0; v < views.size(); ++v) views[v].photo = uploads[v].address();
  const std::vector<soup::ExposureGrid> gains = train::start_exposures(*gpu, s.soup, s.buffers, views);
  REQUIRE(gains.size() == views.size());
  glm::vec3 mean(0);
  for (std::size_t v = 0; v < views.size(); ++v) mean += gain_of(v) / float(views.size());
  for (std::size_t v = 0; v < views.size(); ++v)
    for (int c = 0; c < 3; ++c) CHECK(gains[v][4][c] == Approx(gain_of(v)[c] - mean[c]).margin(0.03));

  const train::Exposures exposures =
      train::allocate_exposures(*gpu, static_cast<std::uint32_t>(views.size()), 1, gains);
  const train::FixedSums sums =
      train::sum_photographs(*gpu, s.soup, s.buffers, views, s.soup.table, s.soup.own(), &exposures);
  const std::size_t words = 4 * s.soup.table.size() * soup::samples_at(0);
  const auto low = gpu->download_vector<std::uint32_t>(sums.low.address(), words),
             high = gpu->download_vector<std::uint32_t>(sums.high.address(), words);
  std::size_t seen = 0;
  for (std::size_t i = 0; i < words / 4; ++i) {
    const std::uint32_t triangle = static_cast<std::uint32_t>(i / soup::samples_at(0)) + 1;
    const double weight = train::fixed_sum(low[4 * i + 3], high[4 * i + 3]);
    if (weight < 0.01 || triangle % 5 == 0) continue;
    ++seen;
    const glm::vec3 expected = f32::exposed({mean, 0}, colour_at(triangle));
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(train::fixed_sum(low[4 * i + c], high[4 * i + c]) / weight == Approx(expected[int(c)]).margin(0.01));
  }
  CHECK(seen > 40);
  test::require_silence(*gpu);
}

TEST_CASE("a resumed training with exposures gives the same bits", "[exposure]") {
  auto gpu = test::open_device();
  const scene::Scene scene = ring_scene(true);
  const train::Settings settings = ring_settings(24, true);
  train::Trainer whole(*gpu, scene, settings, ring_start(settings));
  whole.run({});

  test::TemporaryFolder folder;
  const auto path = folder.path() / "checkpoint.safetensors";
  train::Trainer first(*gpu, scene, settings, ring_start(settings));
  std::atomic<bool> stop = false;
  train::Trainer::Callbacks callbacks;
  callbacks.stop = &stop;
  callbacks.progress_every = 11;
  callbacks.on_progress = [&](const train::Progress&) { stop = true; };
  first.run(callbacks);
  REQUIRE(first.step() == 11);
  first.write_checkpoint(path);
  train::Trainer second(*gpu, scene, settings, path);
  CHECK(second.exposures() == first.exposures());
  second.run({});

  CHECK(whole.model().lattice == second.model().lattice);
  CHECK(whole.model().vertices == second.model().vertices);
  CHECK(whole.exposures() == second.exposures());
  REQUIRE(whole.exposures().size() == scene.train.size());
  CHECK(whole.exposures()[0] != soup::ExposureGrid());
  train::Settings without = settings;
  without.exposure = false;
  CHECK_THROWS_WITH(train::Trainer(*gpu, scene, without, path), Catch::Contains("`exposure` true (now false)"));
  test::require_silence(*gpu);
}

TEST_CASE("photographs with different exposures give the colour of their mean", "[exposure][training][repeats]") {
  auto gpu = test::open_device();
  const scene::Scene scene = ring_scene(true);
  double psnr[2];
  for (const bool exposure : {false, true}) {
    const train::Settings settings = ring_settings(200, exposure);
    train::Trainer trainer(*gpu, scene, settings, ring_start(settings));
    trainer.run({});
    psnr[exposure] = trainer.evaluate_float().mean.psnr;
    const auto exposures = trainer.exposures();
    if (!exposure) {
      CHECK(exposures.empty());
      continue;
    }
    glm::vec3 gain(0);
    for (const soup::ExposureGrid& grid : exposures)
      for (const glm::vec3& there : grid) gain += there / float(grid.size() * exposures.size());
    for (int c = 0; c < 3; ++c) {
      CHECK(gain[c] == Approx(0).margin(0.02));
      // Brighter photographs get larger gains.
      CHECK(exposures[1][12][c] > exposures[2][12][c] + 0.3f);
    }
  }
  CAPTURE(psnr[0], psnr[1]);
  CHECK(psnr[1] > psnr[0] + 1);
  test::require_silence(*gpu);
}

TEST_CASE("what a camera's lens takes from all its photographs is found, and expected of others",
          "[exposure][training][repeats]") {
  auto gpu = test::open_device();
  scene::Scene scene = ring_scene(false);
  for (std::size_t i = 0; i < scene.train.size(); ++i) {
    const bool vignettes = i % 2 == 0;
    scene.train[i] = square_view(6.2831853 * double(i) / 12, glm::vec3(0), vignettes ? -3.0f : 0.0f);
    scene.train[i].name = (vignettes ? "a/" : "b/") + scene.train[i].name;
  }
  scene.test = {square_view(0.3, glm::vec3(0), -3.0f), square_view(0.3, glm::vec3(0))};
  scene.test[0].name = "a/test", scene.test[1].name = "b/test";
  const train::Settings settings = ring_settings(200, true);
  train::Trainer trainer(*gpu, scene, settings, ring_start(settings));
  trainer.run({});
  const train::ViewExposures exposures(train::photograph_exposures(scene.train, trainer.exposures()));
  const auto falloff = [&](std::size_t view) {
    const soup::ExposureGrid grid = exposures.at(scene.test[view]);
    return (grid[11] + grid[13]) / 2.0f - grid[12];
  };
  for (int c = 0; c < 3; ++c) {
    // The places lie half way to the sides: a quarter of the falloff, a little less by the prior.
    CHECK(falloff(0)[c] - falloff(1)[c] == Approx(-0.75).margin(0.1));
    CHECK(std::abs(falloff(1)[c]) < 0.08);
  }
  test::require_silence(*gpu);
}

TEST_CASE("test views of a second camera are compared as it shows colours", "[exposure][training][repeats]") {
  auto gpu = test::open_device();
  scene::Scene scene = ring_scene(false);
  scene.test = {square_view(0.3, glm::vec3(0)), square_view(1.9, glm::vec3(-1.2f))};
  for (std::size_t i = 0; i < scene.train.size(); ++i) {
    const bool dark = i % 3 == 0;
    scene.train[i] = square_view(6.2831853 * double(i) / 12, glm::vec3(dark ? -1.2f : 0.0f));
    scene.train[i].name = (dark ? "b/" : "a/") + scene.train[i].name;
  }
  scene.test[0].name = "a/test", scene.test[1].name = "b/test";
  const train::Settings settings = ring_settings(200, true);
  train::Trainer trainer(*gpu, scene, settings, ring_start(settings));
  trainer.run({});
  soup::Model model = trainer.model();
  REQUIRE(model.exposures.size() == scene.train.size());
  const auto psnr = [&](std::size_t view) {
    return train::evaluate(*gpu, model, scene, 0.025, 2.5).views[view].metrics.psnr;
  };
  const double bright = psnr(0), dark = psnr(1);
  CHECK(trainer.evaluate_float().views[1].metrics.psnr == Approx(dark).margin(0.5));
  model.exposures.clear();
  CAPTURE(bright, dark, psnr(0), psnr(1));
  CHECK(bright > psnr(0) + 0.3);
  CHECK(dark > psnr(1) + 3);
  test::require_silence(*gpu);
}
