// Tests engine/run/trainer.h on a device: evaluation does not change the training, submission of steps, checkpoints,
// and settings for opacity and levels.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <thread>

#include "format/lattice_hierarchy.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "soup/texture_table.h"
#include "temporary_folder.h"
#include "train/config/schedule.h"
#include "train/start/random_start.h"
#include "train/start/surface_start.h"
#include "train/step/small_views.h"

using namespace trisoup;

namespace {

scene::View view(double angle, std::uint8_t shade, int side = 24) {
  scene::View v;
  v.name = std::to_string(angle);
  v.camera.width = v.camera.height = side;
  v.camera.fx = v.camera.fy = 1.25 * side;
  v.camera.cx = v.camera.cy = 0.5 * side;
  const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
  v.camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1)));
  v.image = {side, side, {}};
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      const bool inside = std::abs(row - side / 2) < 7 && std::abs(column - side / 2) < 7;
      const int green = inside ? 40 + 192 * row / side : 255;
      for (const int c : {inside ? int(shade) : 255, green, 255, 255})
        v.image.rgba.push_back(static_cast<std::uint8_t>(c));
    }
  return v;
}

scene::Scene square_scene() {
  scene::Scene scene;
  for (int i = 0; i < 5; ++i) scene.train.push_back(view(1.2 * i, static_cast<std::uint8_t>(30 * i)));
  scene.test = {view(0.6, 20), view(3.0, 70)};
  scene.background = glm::vec3(1.0f);
  scene.synthetic = true;
  return scene;
}

train::Settings short_settings() {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.steps = 40;
  s.triangles = s.init_count = 60;
  s.init_radius = 0.05;
  s.refine_every = 10;
  s.checkpoint_every = 0;
  s.level_max = 4;
  return s;
}

/// Trains up to `step` and stops like an interrupted training. seen: called after every step.
void run_to(train::Trainer& trainer, std::uint64_t step, const std::function<void(const train::Progress&)>& seen = {}) {
  train::Trainer::Callbacks callbacks;
  std::atomic<bool> stop = false;
  callbacks.stop = &stop;
  callbacks.progress_every = 1;
  callbacks.on_progress = [&](const train::Progress& p) {
    stop = p.step == step;
    if (seen) seen(p);
  };
  trainer.run(callbacks);
  REQUIRE(trainer.step() == step);
}

std::vector<glm::vec3> start(const train::Settings& s) {
  return soup::triangles_in_box(s.init_count, glm::vec3(-0.2f), glm::vec3(0.2f), s.init_radius, 3);
}

}  // namespace

TEST_CASE("PSNR in progress reports includes only steps with pixels in the loss", "[trainer]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  for (const std::size_t v : {0, 2, 3})
    for (std::size_t i = 3; i < scene.train[v].image.rgba.size(); i += 4) scene.train[v].image.rgba[i] = 0;
  train::Settings settings = short_settings();
  settings.batch = 1;
  settings.steps = 5;  // each view once
  std::vector<double> seen;
  std::size_t none = 0;
  const auto run = [&](std::uint64_t every) {
    train::Trainer trainer(*gpu, scene, settings, start(settings));
    train::Trainer::Callbacks callbacks;
    callbacks.progress_every = every;
    callbacks.on_progress = [&](const train::Progress& p) { p.psnr ? seen.push_back(*p.psnr) : void(++none); };
    trainer.run(callbacks);
  };
  run(1);
  REQUIRE(seen.size() == 2);
  CHECK(none == 3);
  const double mse = 0.5 * (std::pow(10, -0.1 * seen[0]) + std::pow(10, -0.1 * seen[1]));
  run(5);
  REQUIRE(seen.size() == 3);
  CHECK(seen[2] == Approx(-10 * std::log10(mse)).epsilon(1e-6));
}

TEST_CASE("evaluation during training changes no bits of the result and does not count as training time",
          "[trainer][driver]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  const train::Settings settings = short_settings();
  train::Trainer alone(*gpu, scene, settings, start(settings));
  alone.run({});

  train::Trainer watched(*gpu, scene, settings, start(settings));
  train::Trainer::Callbacks callbacks;
  callbacks.evaluations_per_decade = 20;
  std::vector<std::uint64_t> steps;
  constexpr double kPause = 0.05;
  callbacks.on_evaluate = [&](std::uint64_t step) {
    steps.push_back(step);
    const train::Evaluation e = watched.evaluate_float();
    CHECK(std::isfinite(e.mean.psnr));
    std::this_thread::sleep_for(std::chrono::duration<double>(kPause));
  };
  const auto begin = std::chrono::steady_clock::now();
  watched.run(callbacks);
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  CHECK(steps == std::vector<std::uint64_t>{10, 11, 13, 14, 16, 18, 20, 22, 25, 28, 32, 35});
  CHECK(watched.seconds() <= wall - kPause * double(steps.size()));
  CHECK(watched.seconds() > 0);
  CHECK(watched.cpu_seconds() > 0);
  const soup::Model a = alone.model(), b = watched.model();
  CHECK(a.vertices == b.vertices);
  CHECK(a.lattice == b.lattice);
  CHECK(a.mlp.parameters == b.mlp.parameters);
  test::require_silence(*gpu);
}

TEST_CASE("textures of a model have the requested number of bits, which does not affect training", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  train::Trainer whole(*gpu, scene, settings, start(settings));
  settings.texture_bits = 3;
  train::Trainer few(*gpu, scene, settings, start(settings));
  whole.run({});
  few.run({});
  soup::Model expected = whole.model();
  const std::vector<std::uint8_t> unrounded = expected.lattice;
  soup::round_textures(expected.lattice, expected.textures, soup::texture_steps(3));
  CHECK(few.model().lattice == expected.lattice);
  CHECK(expected.lattice != unrounded);
  CHECK(few.model().mlp.parameters == whole.model().mlp.parameters);
}

TEST_CASE("the commands of a step fit the view sizes of its batch", "[trainer][driver]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  for (std::size_t i = 0; i < scene.train.size(); ++i)
    scene.train[i] = view(1.2 * double(i), static_cast<std::uint8_t>(30 * i), 16 + 8 * static_cast<int>(i));
  train::Settings settings = short_settings();
  settings.batch = 2;
  // One step at a time, and many steps at a time.
  train::Trainer single(*gpu, scene, settings, start(settings)), many(*gpu, scene, settings, start(settings));
  train::Trainer::Callbacks every;
  every.progress_every = 1;
  single.run(every);
  many.run({});
  CHECK(single.model().vertices == many.model().vertices);
  CHECK(single.model().lattice == many.model().lattice);
  test::require_silence(*gpu);
}

TEST_CASE("steps with pixel jitter sample at different positions and are reproducible", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  std::vector<soup::Model> models;
  std::vector<double> fits;
  for (const double jitter : {0.0, 0.25, 0.25}) {
    train::Settings settings = short_settings();
    settings.pixel_jitter = jitter;
    train::Trainer trainer(*gpu, scene, settings, start(settings));
    fits.push_back(trainer.training_fit().psnr);
    trainer.run({});
    models.push_back(trainer.model());
  }
  CHECK(fits[0] == fits[1]);  // measurements use pixel centres
  CHECK(models[1].lattice == models[2].lattice);
  CHECK(models[0].lattice != models[1].lattice);
  CHECK(models[0].vertices != models[1].vertices);
  test::require_silence(*gpu);
}

TEST_CASE("learning rates of vertices and textures fall independently to their own end values", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  // Returns the mean movement of vertices and texels for these end values of their learning rates.
  const auto moved = [&](double end, double vertex_end) {
    train::Settings settings = short_settings();
    settings.refine_every = 0;
    settings.coarse_share = 0;
    settings.lr_end = end;
    settings.lr_vertex_end = vertex_end;
    train::Trainer trainer(*gpu, scene, settings, start(settings));
    const soup::Model before = trainer.model();
    trainer.run({});
    const soup::Model after = trainer.model();
    double vertices = 0, texels = 0;
    for (std::size_t i = 0; i < after.vertices.size(); ++i)
      vertices += glm::length(after.vertices[i] - before.vertices[i]);
    for (std::size_t i = 0; i < after.lattice.size(); ++i)
      texels += std::abs(int(after.lattice[i]) - int(before.lattice[i]));
    return std::pair(vertices / double(after.vertices.size()), texels / double(after.lattice.size()));
  };
  constexpr double kFast = 1e-9;  // the rate is almost zero after a few steps
  const auto usual = moved(1, 1), vertices_rest = moved(1, kFast), textures_rest = moved(kFast, 1);
  CHECK(vertices_rest.first < 0.5 * usual.first);
  CHECK(vertices_rest.second > 0.7 * usual.second);
  CHECK(textures_rest.first > 0.7 * usual.first);
  CHECK(textures_rest.second < 0.5 * usual.second);
  test::require_silence(*gpu);
}

TEST_CASE("opacity fixed at 1 stays exactly 1 through changes of levels, splits and steps", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.opaque = GENERATE(true, false);
  settings.coarse_share = GENERATE(0.0, 0.5);
  settings.published = GENERATE(false, true);
  settings.samples_per_pixel = GENERATE(0.0, 4.0);
  // Runs half of the combinations. Every combination of any three choices is included.
  const int choices =
      settings.opaque + (settings.coarse_share > 0) + settings.published + (settings.samples_per_pixel > 0);
  if (choices % 2 == 1) return;
  train::Trainer trainer(*gpu, scene, settings, start(settings));
  trainer.run({});
  const soup::Model model = trainer.model();
  const auto [coarsest, finest] =
      std::minmax_element(model.textures.begin(), model.textures.end(),
                          [](const auto& x, const auto& y) { return x.level_max < y.level_max; });
  if (settings.samples_per_pixel > 0)
    REQUIRE(coarsest->level_max < finest->level_max);
  else
    REQUIRE((coarsest->level_max == 4 && finest->level_max == 4));
  std::uint8_t least = 255, features_least = 255;
  for (std::size_t i = 0; i < model.lattice.size(); ++i) {
    std::uint8_t& which = i % soup::kChannels == soup::kChannels - 1 ? least : features_least;
    which = std::min(which, model.lattice[i]);
  }
  if (settings.opaque)
    CHECK(int(least) == 255);
  else
    CHECK(int(least) < 255);
  CHECK(int(features_least) < 255);  // features are trained in both cases
  test::require_silence(*gpu);
}

TEST_CASE("logits of opaque textures are set only in the opacity channel of the coarsest level", "[trainer]") {
  auto gpu = test::open_device();
  const std::vector<soup::TextureLevels> levels{{2, 4}, {0, 0}, {1, 3}, {5, 5}};
  const auto table = soup::make_texture_table(levels);
  const gpu::Buffer buffer =
      train::initial_logits(*gpu, table.entries, {}, std::vector<float>(levels.size(), train::kOpaqueLogit));
  const auto logits = gpu->download_vector<float>(buffer.address(), table.source_samples * 8);
  for (const soup::TextureEntry& row : table.entries)
    for (std::uint32_t s = 0; s < soup::samples_in(row.level_min, row.level_max); ++s)
      for (std::uint32_t c = 0; c < 8; ++c) {
        const float expected = c == 7 && s < soup::samples_at(row.level_min) ? 30.0f : 0.0f;
        REQUIRE(logits[(row.source_offset + s) * 8 + c] == expected);
      }
}

TEST_CASE("the first rendering has the colours and opacity of the start", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.init_opacity = 0.9;
  settings.coarse_share = GENERATE(0.0, 0.5);
  // A box of triangles is visible to all cameras. A single large triangle would be visible from one side only.
  train::Start coloured(soup::triangles_in_box(200, glm::vec3(-0.2f), glm::vec3(0.2f), 0.2, 3));
  coloured.colours.assign(coloured.vertices.size(), glm::vec3(0.2f, 0.5f, 0.8f));
  train::Trainer trainer(*gpu, scene, settings, coloured);
  trainer.evaluate_float([&](const scene::View& view, const std::vector<float>& colour) {
    const std::size_t middle =
        3 * (std::size_t(view.image.height / 2) * std::size_t(view.image.width) + std::size_t(view.image.width / 2));
    // A quarter of a colour comes from the MLP, which is not trained yet.
    for (int c = 0; c < 3; ++c) CHECK(std::abs(colour[middle + std::size_t(c)] - (0.2f + 0.3f * float(c))) < 0.2f);
  });
}

TEST_CASE("refinement never drops the backdrop", "[trainer]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.recipe = train::Recipe::real;
  settings.far = 40;
  settings.triangles = 330;
  settings.init_count = 300;
  settings.init = "surface";
  settings.backdrop = GENERATE(0.0, 10.0);
  std::vector<glm::vec3> vertices = train::backdrop_triangles(10);
  for (const glm::vec3& v : start(settings)) vertices.push_back(v);
  train::Start start_with_backdrop(vertices);
  // The triangles in front come first and are trained. The backdrop shows black photographs as black, not as a hole.
  std::rotate(start_with_backdrop.vertices.begin(), start_with_backdrop.vertices.begin() + 240,
              start_with_backdrop.vertices.end());
  start_with_backdrop.opaque = 80;
  train::Trainer trainer(*gpu, scene, settings, start_with_backdrop);
  trainer.run({});
  if (settings.backdrop > 0) CHECK(trainer.training_fit().uncovered == 0);
  const soup::Model model = trainer.model();
  std::size_t behind = 0;
  const auto area = [](const std::vector<glm::vec3>& v, std::size_t i) {
    return glm::length(glm::cross(v[i + 1] - v[i], v[i + 2] - v[i]));
  };
  const float whole = 0.8f * area(train::backdrop_triangles(10), 0);
  for (std::size_t i = 0; i < model.vertices.size(); i += 3)
    behind += glm::length(model.vertices[i]) > 9 && area(model.vertices, i) > whole;  // not split
  // The cameras form a ring and look inward, so most of the backdrop is never visible.
  if (settings.backdrop > 0)
    CHECK(behind >= 80);
  else
    CHECK(behind < 80);
}

TEST_CASE("uncovered pixels are counted only if the photograph shows something there", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  // The only triangle is not visible: the whole square is uncovered, and the white around it does not count.
  train::Trainer empty(*gpu, scene, settings, std::vector<glm::vec3>{{0, 0, 2}, {0.1f, 0, 2}, {0, 0.1f, 2}});
  const double square = 13.0 * 13.0 / (24.0 * 24.0);
  CHECK(empty.evaluate_float().mean.uncovered == Approx(square));
  CHECK(empty.training_fit().uncovered == Approx(square));
  train::Trainer full(*gpu, scene, settings, soup::triangles_in_box(400, glm::vec3(-0.3f), glm::vec3(0.3f), 0.3, 3));
  CHECK(full.evaluate_float().mean.uncovered == 0);
}

TEST_CASE("the uncovered share in a report belongs to the views of its step", "[trainer]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  for (std::size_t i = 0; i < scene.train.size(); i += 2)
    std::fill(scene.train[i].image.rgba.begin(), scene.train[i].image.rgba.end(), std::uint8_t(255));
  train::Settings settings = short_settings();
  settings.batch = 1;
  settings.refine_every = 0;
  settings.steps = 12;
  settings.pixel_jitter = 0;  // with jitter, the edge of the square would be blurred
  const auto uncovered_at = [&](std::uint64_t every) {
    train::Trainer empty(*gpu, scene, settings, std::vector<glm::vec3>{{0, 0, 2}, {0.1f, 0, 2}, {0, 0.1f, 2}});
    train::Trainer::Callbacks callbacks;
    std::map<std::uint64_t, double> shares;
    callbacks.progress_every = every;
    callbacks.on_progress = [&](const train::Progress& p) { shares[p.step] = p.uncovered; };
    empty.run(callbacks);
    return shares;
  };
  // Of two steps at a time, the report is for the second one, although the buffers were laid out for the first.
  const auto each = uncovered_at(1), pairs = uncovered_at(2);
  REQUIRE(pairs.size() == 6);
  for (const auto& [step, share] : pairs) CHECK(share == each.at(step));
  std::set<double> values;
  for (const auto& [step, share] : each) values.insert(share);
  CHECK(values == std::set<double>{0.0, 13.0 * 13.0 / (24.0 * 24.0)});
}

TEST_CASE("a round of simplification resumes from a checkpoint with the same bits, and reduces the model",
          "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.max_triangles = 20;
  settings.round_steps = 10;
  const test::TemporaryFolder folder;
  const auto checkpoint = folder.path() / "checkpoint.safetensors";
  train::Trainer whole(*gpu, scene, settings, start(settings));
  whole.run({});
  REQUIRE(whole.finished());
  const std::uint32_t before = whole.triangles();
  const std::uint64_t samples = whole.model().lattice.size();
  whole.begin_round({0.6, 1});
  CHECK_FALSE(whole.finished());
  CHECK(whole.last_step() == 50);
  CHECK(whole.model().lattice.size() < 0.7 * double(samples));
  run_to(whole, 44);
  whole.write_checkpoint(checkpoint);
  whole.run({});
  CHECK(whole.step() == 50);
  train::Trainer resumed(*gpu, scene, settings, checkpoint);
  CHECK_FALSE(resumed.finished());
  resumed.run({});
  CHECK(resumed.step() == 50);
  CHECK(resumed.model().lattice == whole.model().lattice);
  CHECK(resumed.model().vertices == whole.model().vertices);
  whole.begin_round({1, 0.5});
  CHECK(whole.triangles() <= (before + 1) / 2);
}

TEST_CASE("a round that removed too much is undone, and its steps still count", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.target_psnr = 20;
  settings.round_steps = 10;
  const test::TemporaryFolder folder;
  const auto state = folder.path() / "round-0.safetensors";
  train::Trainer trainer(*gpu, scene, settings, start(settings));
  trainer.run({});
  const soup::Model before = trainer.model();
  trainer.write_checkpoint(state);
  trainer.begin_round({0.5, 1});
  trainer.run({});
  REQUIRE(trainer.model().lattice.size() < before.lattice.size());
  trainer.go_back(state);
  const soup::Model back = trainer.model();
  CHECK(back.lattice == before.lattice);
  CHECK(back.vertices == before.vertices);
  CHECK(back.mlp.parameters == before.mlp.parameters);
  CHECK(trainer.step() == 50);
  trainer.begin_round({0.9, 1});
  CHECK(trainer.last_step() == 60);
  trainer.run({});
  CHECK(trainer.finished());
  CHECK(trainer.model().lattice.size() > 0.8 * double(before.lattice.size()));
}

TEST_CASE("pruning to the knee during training resumes from a checkpoint with the same bits", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  const auto samples_with = [&](double knee) {
    settings.knee = knee;
    train::Trainer trainer(*gpu, scene, settings, start(settings));
    trainer.run({});
    return trainer.model().lattice.size();
  };
  const std::size_t some = samples_with(0.1);
  CHECK(samples_with(1) < some);
  settings.knee = 0;
  settings.refine_until = 0.6;  // as with a knee
  train::Trainer all(*gpu, scene, settings, start(settings));
  all.run({});
  CHECK(some < all.model().lattice.size());
  settings = short_settings();
  settings.knee = 0.1;
  // At a pruning step, and after the last one.
  for (const std::uint64_t at : {28u, 37u}) {
    const test::TemporaryFolder folder;
    const auto checkpoint = folder.path() / "checkpoint.safetensors";
    train::Trainer whole(*gpu, scene, settings, start(settings));
    run_to(whole, at);
    whole.write_checkpoint(checkpoint);
    whole.run({});
    train::Trainer resumed(*gpu, scene, settings, checkpoint);
    resumed.run({});
    CHECK(resumed.model().lattice == whole.model().lattice);
    CHECK(resumed.model().vertices == whole.model().vertices);
    CHECK(resumed.model().lattice.size() == some);
  }
}

TEST_CASE("no image is downloaded to the host, from the first step to the last measurement", "[trainer]") {
  auto gpu = test::open_device();
  // Covers refinement with both recipes, pruning, painting, exposures, reports and evaluations.
  train::Settings settings = short_settings();
  settings.recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  settings.knee = 0.2;
  settings.refine_until = 0.6;
  settings.exposure = true;
  settings.backdrop = 8;
  const bool paints = settings.recipe == train::Recipe::real;
  if (paints) settings.coarse_share = 0, settings.init = "surface";
  // Uses twelve triangles, so that downloads per triangle are small compared with 221,184 pixels.
  settings.triangles = settings.init_count = 12;
  settings.init_radius = 0.2;
  settings.level_max = settings.level_min;
  settings.steps = 20;
  settings.refine_every = 5;
  scene::Scene scene;
  for (int i = 0; i < 5; ++i) scene.train.push_back(view(1.2 * i, static_cast<std::uint8_t>(30 * i), 192));
  scene.test = {view(0.6, 20, 192)};
  scene.background = glm::vec3(1.0f);
  train::Start begin = start(settings);
  if (paints) begin.colours.assign(begin.vertices.size(), glm::vec3(0.5f));
  const std::uint64_t before = gpu->downloaded_bytes();
  train::Trainer trainer(*gpu, scene, settings, begin);
  train::Trainer::Callbacks callbacks;
  callbacks.progress_every = 10;
  callbacks.on_progress = [](const train::Progress&) {};
  trainer.run(callbacks);
  trainer.evaluate_float();
  trainer.training_fit();
  const std::uint64_t pixels = 6ull * 192 * 192, bytes = gpu->downloaded_bytes() - before;
  CAPTURE(bytes);
  CHECK(bytes < pixels / 2);
  test::require_silence(*gpu);
}

TEST_CASE("training can continue from a model, which is unchanged at first", "[trainer]") {
  auto gpu = test::open_device();
  const scene::Scene scene = square_scene();
  train::Settings settings = short_settings();
  settings.max_triangles = 20;
  settings.round_steps = 10;
  train::Trainer first(*gpu, scene, settings, start(settings));
  first.run({});
  const soup::Model model = first.model();
  train::Trainer again(*gpu, scene, settings, model);
  CHECK(again.finished());
  const soup::Model same = again.model();
  REQUIRE(same.lattice.size() == model.lattice.size());
  std::size_t off = 0;
  for (std::size_t i = 0; i < model.lattice.size(); ++i) {
    CHECK(std::abs(int(same.lattice[i]) - int(model.lattice[i])) <= 1);
    off += same.lattice[i] != model.lattice[i];
  }
  CHECK(off < model.lattice.size() / 1000);
  CHECK(same.mlp.parameters == model.mlp.parameters);
  again.begin_round({0.8, 1});
  // The moments of a loaded model start at zero, so Adam's bias correction must start again too. Without it, the first
  // step would be three times the learning rate.
  run_to(again, 41);
  const double rate = settings.lr_mlp * train::lr_factor(settings, settings.lr_end, 41);
  const soup::Model moved = again.model();
  double longest = 0;
  for (std::size_t i = 0; i < moved.mlp.parameters.size(); ++i)
    longest = std::max(longest, std::abs(double(moved.mlp.parameters[i]) - model.mlp.parameters[i]));
  CHECK(longest > 0.9 * rate);
  CHECK(longest < 1.1 * rate);
  again.run({});
  CHECK(again.step() == 50);
}

TEST_CASE("the first steps use smaller images, the remaining steps use the photographs", "[trainer]") {
  auto gpu = test::open_device();
  const bool coarse = GENERATE(true, false);  // coarse textures in these steps
  // Photographs alternate between black and white pixels on a grey background. At half size they become the same grey,
  // which equals the rendering, because the soup is not visible.
  constexpr int kSide = 128;
  scene::Scene scene = square_scene();
  scene.background = glm::vec3(128 / 255.0f);
  for (std::size_t i = 0; i < scene.train.size(); ++i) {
    scene.train[i] = view(1.2 * double(i), 0, kSide);
    for (int p = 0; p < kSide * kSide; ++p)
      for (int c = 0; c < 3; ++c)
        scene.train[i].image.rgba[4 * static_cast<std::size_t>(p) + static_cast<std::size_t>(c)] =
            (p + p / kSide) % 2 ? 255 : 0;
  }
  train::Settings settings = short_settings();
  settings.refine_every = 0;
  settings.pixel_jitter = 0;
  settings.steps = 8;
  settings.batch = 1;
  settings.coarse_share = coarse ? 0.5 : 0;
  settings.small_share = coarse ? 0 : 0.5;
  std::vector<glm::vec3> vertices = start(settings);
  for (glm::vec3& v : vertices) v.z += 50;
  const auto errors = [&](double scale) {
    settings.published = scale == 1;
    train::Trainer trainer(*gpu, scene, settings, vertices);
    train::Trainer::Callbacks callbacks;
    callbacks.progress_every = settings.steps / 2;
    std::vector<double> l1, uncovered;
    callbacks.on_progress = [&](const train::Progress& p) {
      l1.push_back(p.l1);
      uncovered.push_back(p.uncovered);
    };
    trainer.run(callbacks);
    REQUIRE(l1.size() == 2);
    // The uncovered share refers to the images of a step. In the grey images all pixels equal the background.
    CHECK(uncovered[0] == (scale < 1 ? 0.0 : 1.0));
    CHECK(uncovered[1] == 1.0);
    return l1;
  };
  const std::vector<double> smaller = errors(0.5), whole = errors(1);
  CHECK(smaller[0] < 0.01);
  CHECK(smaller[1] == Approx(0.5).margin(0.01));
  CHECK(whole[0] == Approx(0.5).margin(0.01));
}

TEST_CASE("a view keeps its size if its mask would exclude the whole smaller image", "[trainer]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  for (std::size_t i = 0; i < scene.train.size(); ++i)
    scene.train[i] = view(1.2 * double(i), static_cast<std::uint8_t>(30 * i), 128);
  auto& pixels = scene.train[0].image.rgba;
  for (std::size_t p = 0; p < pixels.size() / 4; ++p) pixels[4 * p + 3] = p % 2 && p / 128 % 2 ? 255 : 0;
  train::Settings settings = short_settings();
  const train::SmallViews small = train::small_views(*gpu, scene.train, settings);
  CHECK((small.views[0].width == 128 && small.images[0].rgba == pixels));
  CHECK((small.views[1].width == 64 && small.views[1].index == 1));
}

TEST_CASE("a training resumes during and right after the steps with smaller images, with the same bits", "[trainer]") {
  auto gpu = test::open_device();
  scene::Scene scene = square_scene();
  for (std::size_t i = 0; i < scene.train.size(); ++i)
    scene.train[i] = view(1.2 * double(i), static_cast<std::uint8_t>(30 * i), 128);
  train::Settings settings = short_settings();
  settings.steps = 20;
  settings.coarse_share = 0;
  settings.small_share = 0.75;
  for (const std::uint64_t at : {8u, 15u}) {
    const test::TemporaryFolder folder;
    const auto checkpoint = folder.path() / "checkpoint.safetensors";
    train::Trainer whole(*gpu, scene, settings, start(settings));
    run_to(whole, at, [](const train::Progress& p) {
      // 15 of the 20 steps use a quarter of the pixels.
      CHECK(p.pace == Approx(p.step < 15 ? (15.0 - double(p.step) + 5 * 4) / (20.0 - double(p.step)) : 1.0));
    });
    whole.write_checkpoint(checkpoint);
    whole.run({});
    train::Trainer resumed(*gpu, scene, settings, checkpoint);
    resumed.run({});
    CHECK(resumed.model().lattice == whole.model().lattice);
    CHECK(resumed.model().vertices == whole.model().vertices);
  }
}

TEST_CASE("smaller images are area means within masks, and at least 64 x 64", "[trainer]") {
  auto gpu = test::open_device();
  train::Settings settings = short_settings();
  scene::View large = view(0.3, 90, 200), small = view(0.3, 90, 96), tiny = view(0.3, 90, 24);
  for (std::size_t p = 0; p < 200; ++p) large.image.rgba[4 * p + 3] = 0;  // the first row is not in the loss
  const train::SmallViews smaller = train::small_views(*gpu, {large, small, tiny}, settings);
  REQUIRE(smaller.views.size() == 3);
  CHECK((smaller.views[0].width == 100 && smaller.views[0].height == 100));
  CHECK((smaller.views[1].width == 64 && smaller.views[1].height == 64));
  CHECK((smaller.views[2].width == 24 && smaller.views[2].height == 24));
  CHECK(smaller.images[2].rgba == tiny.image.rgba);
  const auto at = [](const Image& image, int x, int y, int c) {
    return int(image.rgba[4 * static_cast<std::size_t>(y * image.width + x) + static_cast<std::size_t>(c)]);
  };
  for (const int c : {0, 1, 2}) {
    const int sum = at(large.image, 90, 96, c) + at(large.image, 91, 96, c) + at(large.image, 90, 97, c) +
                    at(large.image, 91, 97, c);
    CHECK(std::abs(4 * at(smaller.images[0], 45, 48, c) - sum) <= 2);
    CHECK(at(smaller.images[0], 7, 0, c) == at(large.image, 14, 1, c));
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    CHECK(smaller.views[i].index == i);
    CHECK(gpu->download_vector<std::uint8_t>(smaller.views[i].photo, smaller.images[i].rgba.size()) ==
          smaller.images[i].rgba);
  }
}
