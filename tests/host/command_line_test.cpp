// Tests trainer/command_line.h: what options and presets come to.
#include <catch2/catch.hpp>

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/read_file.h"
#include "recipe_settings.h"
#include "run/checkpoint.h"
#include "temporary_folder.h"
#include "train/config/schedule.h"
#include "train/config/settings.h"
#include "trainer/command_line.h"
#include "trainer/settings_file.h"

using namespace trisoup;

namespace {

train::Settings settings_of(std::vector<std::string> options, bool synthetic, bool points = false,
                            std::vector<int> widths = {}) {
  options.insert(options.begin(), {"soup-train", "scene", "-o", "out"});
  std::vector<char*> argv;
  for (std::string& word : options) argv.push_back(word.data());
  CommandLine line;
  REQUIRE_FALSE(parse(static_cast<int>(argv.size()), argv.data(), line).has_value());
  scene::Scene scene;
  scene.synthetic = synthetic;
  for (int i = 0; points && i < 8; ++i) scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
  for (const int width : widths)
    scene.train.emplace_back().camera.width = width, scene.train.back().camera.height = 500;
  return line.settings(scene);
}

double way(const train::Settings& s) {
  double sum = 0;
  for (std::uint64_t step = 1; step <= s.steps; ++step) sum += s.lr_vertex * train::vertex_lr_factor(s, step);
  return sum;
}

/// Settings of a real scene of 50 photographs.
train::Settings settings_of_room(const std::vector<std::string>& set, const char* preset = "fast", bool points = true) {
  scene::Scene scene;
  scene.synthetic = false;
  scene.train.resize(50);
  for (int i = 0; points && i < 8; ++i) scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
  train::SettingsRequest request;
  request.preset = preset;
  for (const std::string& text : set) request.assignments.push_back(train::read_assignment(text));
  return train::make_settings(request, scene);
}

}  // namespace

TEST_CASE("from a surface most steps look at smaller pictures where most photographs are large", "[command_line]") {
  const auto share = [](std::vector<std::string> options, std::vector<int> widths, bool synthetic = false) {
    return settings_of(std::move(options), synthetic, !synthetic, std::move(widths)).small_share;
  };
  CHECK(share({}, {400, 100, 400}) == 0.75);
  CHECK(share({}, {399, 399, 4000}) == 0);
  CHECK(share({}, {}) == 0);
  CHECK(share({"--set", "small_share=0"}, {400, 400}) == 0);
  CHECK(share({"--preset", "published"}, {400, 400}) == 0);
  CHECK(share({}, {400, 400}, true) == 0);
}

TEST_CASE("without options the settings are the best preset's", "[command_line]") {
  for (const bool synthetic : {true, false})
    for (const train::Settings& s : {settings_of({}, synthetic), settings_of({"--preset", "best"}, synthetic)}) {
      CHECK(s.steps == 10'000);
      CHECK(s.triangles == 15'000);
      CHECK(s.level_max == 5);
      CHECK(s.samples_per_pixel == 1);
      CHECK((s.pixel_jitter == 0.25 && s.random_background == 0.2));
      CHECK(s.exposure == !synthetic);
      CHECK_FALSE(s.published);
      CHECK((s.lr_end == 0.1 && s.lr_vertex_end == 0.1 && s.huber == 0.1 && s.texture_bits == 6 && s.knee == 0.2));
      CHECK(way(s) == Approx(synthetic ? 1.5 : 4.0).epsilon(0.01));
      CHECK(s.init_count == 30'000);
    }
  // A quality says itself where to end.
  CHECK((settings_of({"--target-psnr", "28"}, true).knee == 0.05 &&
         settings_of({"--target-ssim", "0.9"}, true).knee == 0.05));
  CHECK((settings_of({"--target-psnr", "28", "--knee", "0.3"}, true).knee == 0.3 &&
         settings_of({"--max-mb", "1"}, true).knee == 0.2));
  CHECK(settings_of({"--target-psnr", "28", "--preset", "published"}, true).knee == 0);
  // A model that is there is recorded as it was trained.
  CommandLine simplify;
  simplify.model = "model.glb";
  simplify.request.assignments.push_back(train::read_assignment("target_psnr=28"));
  CHECK(simplify.of_model(train::to_json(settings_of({"--knee", "0.3"}, true)), scene::Scene{}).knee == 0.3);
  CHECK(settings_of({"--set", "samples_per_pixel=0"}, true).samples_per_pixel == 0);
  CHECK(settings_of({"--set", "pixel_jitter=0"}, true).pixel_jitter == 0);
  CHECK(settings_of({"--exposure"}, true).exposure);
  CHECK_FALSE(settings_of({"--exposure=false"}, false).exposure);
}

TEST_CASE("the scene decides on the triangles of a surface unless somebody does", "[command_line]") {
  const train::Settings free = settings_of_room({});
  CHECK((free.triangles == 8000 && free.least_shift == 0.05));
  CHECK((free.init_count == 8000 && free.most_triangles == 8000));
  CHECK(settings_of_room({}, "best").triangles == 60'000);
  const train::Settings given = settings_of_room({"triangles=3000"});
  CHECK((given.triangles == 3000 && given.least_shift == 0));
  const train::Settings ceiling = settings_of_room({"triangles=3000", "least_shift=0.02"});
  CHECK((ceiling.triangles == 3000 && ceiling.least_shift == 0.02));
  const train::Settings usual = settings_of_room({"least_shift=0"});
  CHECK((usual.triangles == 2000 && usual.most_triangles == 2000));
  CHECK(settings_of_room({"init=random", "least_shift=1"}).triangles == 2000);
  for (const train::Settings& s : {settings_of_room({"init=random"}), settings_of_room({}, "fast", false)})
    CHECK((s.triangles == 2000 && s.least_shift == 0));
  CHECK((settings_of_room({}, "published").triangles == 15'000 && settings_of_room({}, "published").least_shift == 0));
}

TEST_CASE("a surface is refined five times at most, random triangles more often", "[command_line]") {
  const auto refinements = [](const train::Settings& s) {
    int count = 0;
    for (std::uint64_t step = 0; step <= s.steps; ++step) count += train::is_refinement(s, step);
    return count;
  };
  for (const char* steps : {"steps=1000", "steps=3000", "steps=10000"})
    CHECK(refinements(settings_of_room({steps, "knee=0"})) == 5);
  CHECK(refinements(settings_of_room({"steps=400", "knee=0"})) == 2);
  CHECK(refinements(settings_of_room({"steps=3000", "knee=0", "init=random"})) == 28);
}

TEST_CASE("poses of real scenes are corrected unless points fit well", "[command_line][poses]") {
  const auto settings = [](float error, std::vector<std::string> set, bool synthetic = false) {
    scene::Scene scene;
    scene.synthetic = synthetic;
    scene.train.resize(50);
    for (int i = 0; error != 0 && i < 8; ++i) {
      scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
      scene.points.errors.push_back(i == 0 ? -1.0f : error);  // one is unknown
    }
    train::SettingsRequest request;
    request.preset = "fast";
    for (const std::string& text : set) request.assignments.push_back(train::read_assignment(text));
    return train::make_settings(request, scene);
  };
  CHECK(settings(0, {}).pose_corrections);
  CHECK(settings(0.6f, {}).pose_corrections);
  CHECK_FALSE(settings(0.4f, {}).pose_corrections);
  CHECK_FALSE(settings(0, {}, true).pose_corrections);
  CHECK(settings(0, {}).pose_motion == 0.25);
  CHECK(settings(0, {}).pose_every == 13);  // 50 photographs, 4 in a step
  CHECK(settings(0, {"steps=10000"}).pose_every == 100);
  const train::Settings asked = settings(0.4f, {"pose_corrections=true"}, true);
  CHECK((asked.pose_corrections && asked.pose_motion == 0 && asked.pose_every > 0));
  CHECK_FALSE(settings(0, {"pose_corrections=false"}).pose_corrections);
  CHECK_FALSE(settings_of({"--preset", "published"}, false).pose_corrections);
}

TEST_CASE("as published is everything that has an option", "[command_line]") {
  for (const bool synthetic : {true, false}) {
    const train::Settings published =
                              test::settings_of_recipe(synthetic ? train::Recipe::synthetic : train::Recipe::real),
                          s = settings_of({"--preset", "published"}, synthetic);
    CHECK(s.steps == 10'000);
    CHECK(s.triangles == 15'000);
    CHECK(s.level_max == 5);
    CHECK(s.init_count == (synthetic ? 100'000 : 30'000));  // of a real one without points
    CHECK(s.lr_vertex == published.lr_vertex);
    CHECK((s.lr_end == 0.01 && s.lr_vertex_end == 0.01 && s.huber == 0 && s.texture_bits == 8 && s.knee == 0));
    CHECK(s.samples_per_pixel == 0);
    CHECK((s.pixel_jitter == 0 && s.random_background == 0));
    CHECK((s.published && !s.exposure));
    CHECK(settings_of({"--preset", "published", "--exposure"}, synthetic).exposure);
    // More steps than published do not slow vertices down.
    CHECK(settings_of({"--preset", "published", "--steps", "30000"}, synthetic).lr_vertex == published.lr_vertex);
    // Options win over the preset, and of an option given twice the last counts.
    CHECK(settings_of({"--preset", "published", "--set", "pixel_jitter=0.5"}, synthetic).pixel_jitter == 0.5);
    CHECK(settings_of({"--set", "opaque=false", "--set", "opaque=true"}, synthetic).opaque);
    CHECK_FALSE(settings_of({"--set", "opaque=true", "--set", "opaque=false"}, synthetic).opaque);
    CHECK(settings_of({"--seed", "3", "--seed", "4"}, synthetic).seed == 4);
  }
}

TEST_CASE("few steps have the published way of vertices, presets their own", "[command_line]") {
  CHECK(way(settings_of({"--preset", "published", "--steps", "1000"}, true)) == Approx(0.537).epsilon(0.01));
  CHECK(settings_of({"--preset", "published", "--steps", "1000"}, false).lr_vertex == train::kMaxVertexLr);
  CHECK(way(settings_of({"--preset", "published", "--steps", "5000"}, false)) == Approx(5.37).epsilon(0.01));
  CHECK(way(settings_of({"--steps", "5000"}, false)) == Approx(4.0).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast"}, true)) == Approx(1.5).epsilon(0.01));
  CHECK(settings_of({"--preset", "fast", "--steps", "300"}, true).lr_vertex == train::kMaxVertexLrSynthetic);
  CHECK(settings_of({"--preset", "fast", "--steps", "300"}, false).lr_vertex == train::kMaxVertexLr);
  CHECK(way(settings_of({"--preset", "fast", "--steps", "700", "--set", "lr_end=0.5"}, true)) ==
        Approx(1.5).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "balanced"}, false)) == Approx(4.0).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast", "--recipe", "synthetic"}, false)) == Approx(1.5).epsilon(0.01));
  CHECK(settings_of({"--preset", "fast"}, true).lr_end == 0.1);
  // lr_end is for all rates, lr_vertex_end for vertices alone.
  CHECK(settings_of({"--set", "lr_end=0.2"}, true).lr_vertex_end == 0.2);
  const train::Settings own = settings_of(
      {"--set", "lr_end=0.2", "--set", "lr_vertex_end=0.05", "--set", "huber=0.3", "--texture-bits", "5"}, true);
  CHECK(own.texture_bits == 5);
  CHECK((own.lr_end == 0.2 && own.lr_vertex_end == 0.05 && own.huber == 0.3));
  CHECK(way(own) == Approx(1.5).epsilon(0.01));
}

TEST_CASE("preset fast takes more steps of fewer views from random triangles", "[command_line]") {
  const auto work = [](const train::Settings& s) { return std::pair(s.steps, s.batch); };
  CHECK(work(settings_of({"--preset", "fast"}, true)) == std::pair(std::uint64_t{2000}, 2u));
  CHECK(work(settings_of({"--preset", "fast", "--steps", "300"}, true)) == std::pair(std::uint64_t{300}, 2u));
  CHECK(work(settings_of({"--preset", "fast", "--set", "batch=3"}, true)) == std::pair(std::uint64_t{2000}, 3u));
  CHECK(work(settings_of({"--preset", "fast"}, false, true)) == std::pair(std::uint64_t{1000}, 4u));
  CHECK(work(settings_of({"--preset", "fast", "--init", "surface"}, true, true)) == std::pair(std::uint64_t{1000}, 4u));
  CHECK(work(settings_of({"--preset", "balanced"}, true)) == std::pair(std::uint64_t{3000}, 4u));
  CHECK(work(settings_of({"--preset", "published", "--steps", "1000"}, true)) == std::pair(std::uint64_t{1000}, 4u));
}

TEST_CASE("from a surface vertices come to rest before textures do", "[command_line]") {
  const train::Settings s = settings_of({"--preset", "balanced"}, false, true);
  REQUIRE(s.init == "surface");
  CHECK((s.lr_end == 0.1 && s.lr_vertex_end == 0.03 && s.huber == 0.1));
  CHECK(way(s) == Approx(4.0).epsilon(0.01));
  CHECK(settings_of({"--set", "lr_end=0.5"}, false, true).lr_vertex_end == 0.5);
  CHECK(settings_of({"--set", "lr_vertex_end=0.5"}, false, true).lr_vertex_end == 0.5);
  CHECK(settings_of({"--preset", "published"}, false, true).lr_vertex_end == 0.01);
  CHECK(train::vertex_lr_factor(s, s.steps) < 1e-3 * train::vertex_lr_factor(s, 1));
  CHECK(s.coarse_share == 0);
  CHECK(train::starts_from_surface(s));
  for (const train::Settings& other : {settings_of({"--preset", "published"}, false, true), settings_of({}, true),
                                       settings_of({"--init", "points"}, false, true)}) {
    CHECK_FALSE(train::starts_from_surface(other));
    CHECK(other.coarse_share == 0.5);
    CHECK(train::vertex_lr_factor(other, other.steps) == Approx(other.lr_vertex_end));
  }
  CHECK(settings_of({"--preset", "fast", "--set", "lr_vertex=0.02"}, true).lr_vertex == 0.02);
  CHECK(settings_of({"--set", "lr_vertex=0.00025", "--steps", "1000"}, true).lr_vertex == 0.00025);
}

namespace {

CommandLine line_of(std::vector<std::string> options) {
  options.insert(options.begin(), {"soup-train", "scene", "-o", "out"});
  std::vector<char*> argv;
  for (std::string& word : options) argv.push_back(word.data());
  CommandLine line;
  REQUIRE_FALSE(parse(static_cast<int>(argv.size()), argv.data(), line).has_value());
  return line;
}

/// The settings with which a training begun with some options continues with others, half way.
train::Settings resumed(const std::vector<std::string>& begun, const std::vector<std::string>& now, bool synthetic) {
  scene::Scene scene;
  scene.synthetic = synthetic;
  scene.normalisation.scale = 0.25;
  for (int i = 0; !synthetic && i < 8; ++i) scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
  const CommandLine first = line_of(begun);
  train::CheckpointInfo info{0, first.settings(scene), first.note()};
  info.step = info.settings.steps / 2;
  CommandLine second = line_of(now);
  second.take(info.note, "c");
  return second.resumed(info, scene, "c");
}

}  // namespace

TEST_CASE("a training that goes on has the settings of its checkpoint", "[command_line]") {
  const bool synthetic = GENERATE(true, false);
  const std::vector<std::string> begun = {"--preset",      "fast",
                                          "--steps",       "700",
                                          "--triangles",   "500",
                                          "--seed",        "3",
                                          "--init-box",    "0.7",
                                          "--init-radius", "0.2",
                                          "--set",         "lr_end=0.2",
                                          "--set",         "lr_vertex_end=0.3",
                                          "--set",         "opaque=true",
                                          "--set",         "huber=0.05",
                                          "--far",         "70",
                                          "--set",         "level_min=1",
                                          "--set",         "refine_every=50"};
  const train::Settings first = line_of(begun).settings([&] {
    scene::Scene scene;
    scene.synthetic = synthetic;
    scene.normalisation.scale = 0.25;
    for (int i = 0; !synthetic && i < 8; ++i) scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
    return scene;
  }());
  CHECK(differences(first, resumed(begun, {}, synthetic)).empty());
  CHECK(differences(first, resumed(begun, begun, synthetic)).empty());
  for (const std::vector<std::string>& agrees : std::vector<std::vector<std::string>>{{"--seed", "3"},
                                                                                      {"--set", "lr_end=0.2"},
                                                                                      {"--init-radius", "0.2"},
                                                                                      {"--set", "opaque=true"},
                                                                                      {"--level-max", "4"}})
    CHECK(differences(first, resumed(begun, agrees, synthetic)).empty());
  CHECK(differences(first, resumed(begun, {"--preset", "fast"}, synthetic)).empty());
  CHECK(resumed(begun, {"--checkpoint-every", "17"}, synthetic).checkpoint_every == 17);
  CHECK(resumed(begun, {"--eval-every", "9"}, synthetic).eval_every == 9);
}

TEST_CASE("what contradicts a checkpoint is told with both values, and nothing else is", "[command_line]") {
  using Catch::Equals;
  const auto told = [](const std::string& what) {
    return Equals("c: was trained with " + what +
                  "; without these options it goes on as it began, or train anew with --overwrite");
  };
  const std::vector<std::string> begun = {"--preset", "fast", "--init-box", "0.7", "-r", "2"};
  CHECK_THROWS_WITH(resumed(begun, {"--seed", "5"}, true), told("`seed` 0 (now 5)"));
  CHECK_THROWS_WITH(resumed(begun, {"--seed", "0", "--triangles", "7", "--level-max", "5"}, true),
                    told("`level_max` 4 (now 5), `triangles` 2000 (now 7)"));
  CHECK_THROWS_WITH(resumed(begun, {"--preset", "best"}, true), told("`preset` \"fast\" (now \"best\")"));
  CHECK_THROWS_WITH(resumed(begun, {"--init-box", "0.75"}, true), told("`init_box` 0.7 (now 0.75)"));
  CHECK_THROWS_WITH(resumed(begun, {"-r", "1"}, true), told("`resolution` 2.0 (now 1.0)"));
  CHECK_THROWS_WITH(
      resumed(begun, {"--test-every", "3", "--alpha", "mask", "--background", "black"}, true),
      told("`test_every` 8 (now 3), `background` \"auto\" (now \"black\"), `alpha` \"composite\" (now \"mask\")"));
  CHECK_THROWS_WITH(resumed(begun, {"--steps", "999"}, true), told("`steps` 2000 (now 999)"));
  CHECK_THROWS_WITH(resumed(begun, {"--set", "opaque=true"}, true), told("`opaque` false (now true)"));
  CHECK_THROWS_WITH(resumed(begun, {"--recipe", "real"}, true), told("`recipe` \"synthetic\" (now \"real\")"));
  CHECK_THROWS_WITH(resumed({}, {"--set", "coarse_share=0"}, true), told("`coarse_share` 0.5 (now 0.0)"));
}

TEST_CASE("what a checkpoint notes of the dataset's options is taken where they are not given", "[command_line]") {
  const CommandLine first = line_of({"-r", "4", "--test-every", "5", "--background", "white", "--alpha", "mask",
                                     "--feature-size", "800", "--eval-log", "3", "--preset", "published"});
  CommandLine second = line_of({"--eval-log", "2"});
  second.take(first.note(), "c");
  CHECK(second.load.downscale == 4);
  CHECK(second.load.test_every == 5);
  CHECK(second.load.background == scene::BackgroundChoice::white);
  CHECK(second.load.alpha == scene::AlphaUse::mask);
  CHECK(second.feature_size == 800);
  CHECK(second.evaluations_per_decade == 2);
  CHECK_FALSE(second.load.outside);
  CHECK_FALSE(second.load.invert_masks);
  CommandLine outside = line_of({"--outside"}), later = line_of({});
  later.take(outside.note(), "c");
  CHECK(later.load.outside);
  CommandLine inverted = line_of({"--invert-masks"}), resumed_later = line_of({});
  resumed_later.take(inverted.note(), "c");
  CHECK(resumed_later.load.invert_masks);
  CHECK_THROWS_WITH(inverted.take(line_of({}).note(), "c"), Catch::Contains("`invert_masks` false (now true)"));
  CHECK_THROWS_WITH(inverted.take("{}", "c"), Catch::Contains("`invert_masks` false (now true)"));
  CommandLine mapped = line_of({"--depth-maps", "inverse", "--depth-unit", "0.01"}), mapped_later = line_of({});
  mapped_later.take(mapped.note(), "c");
  CHECK(mapped_later.load.depth_maps == scene::DepthMaps::inverse);
  CHECK(mapped_later.load.depth_unit == 0.01);
  CHECK_THROWS_WITH(mapped.take("{}", "c"), Catch::Contains("`depth_maps` \"none\" (now \"inverse\")"));
  CHECK(second.request.preset == "published");  // for the next checkpoint's note
  CHECK_THROWS_WITH(second.take(R"({"resolution": "fine"})", "c"), Catch::Contains("c: its note is damaged"));
  CHECK_NOTHROW(second.take("anything", "c"));
}

TEST_CASE("more steps than a training began with prolong its schedule", "[command_line]") {
  const train::Settings first = resumed({"--preset", "fast", "--steps", "1000"}, {}, true),
                        longer = resumed({"--preset", "fast", "--steps", "1000"},
                                         {"--preset", "fast", "--steps", "4000"}, true);
  CHECK(longer.steps == 4000);
  CHECK(train::coarse_end(first) == 500);
  CHECK(train::coarse_end(longer) == 500);  // is over in a training that has completed 500 steps
  CHECK(train::lr_factor(longer, longer.lr_end, 4000) == Approx(0.1));
  CHECK(train::lr_factor(longer, longer.lr_end, 1000) == Approx(std::pow(0.1, 0.25)));
  CHECK(longer.lr_vertex == first.lr_vertex);
  CHECK_FALSE(train::is_refinement(first, 1000));
  CHECK(train::is_refinement(longer, 1000));
  CHECK(train::is_last_refinement(longer, 2700));  // before the first step down to the knee
  // What a goal brings is that of the steps before.
  const std::vector<std::string> goal = {"--preset", "fast", "--steps", "1000", "--target-psnr", "28"},
                                 on = {"--preset", "fast", "--steps", "4000", "--target-psnr", "28"};
  CHECK((resumed(goal, on, true).round_steps == 50 && resumed(goal, {"--steps", "4000"}, true).round_steps == 50));
  // Before the change of levels that is still to come, and comes at its share.
  const train::Settings early = train::extended(first, 499, 4000);
  CHECK(train::coarse_end(early) == 2000);
  CHECK(differences(train::extended(first, 10, 1000), first).empty());
  // Smaller pictures, too, do not come again.
  train::Settings small = first;
  small.coarse_share = 0, small.small_share = 0.75;
  CHECK(train::small_end(train::extended(small, 750, 4000)) == 750);
  CHECK(train::small_end(train::extended(small, 749, 4000)) == 3000);
  small.coarse_share = 0.8;
  CHECK(train::small_end(small) == 800);
}

TEST_CASE("a record gives all settings, options win, and what it says of the dataset is taken", "[command_line]") {
  const bool synthetic = GENERATE(true, false);
  scene::Scene scene;
  scene.synthetic = synthetic;
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "metrics.json").string(), bare = (folder.path() / "settings.json").string();
  const CommandLine first = line_of({"--preset", "fast", "--steps", "700", "--set", "huber=0.3", "-r", "2", "--alpha",
                                     "mask", "--max-mb", "1", "--round-steps", "33"});
  const train::Settings then = first.settings(scene);
  const auto write = [](const std::string& to, const nlohmann::json& json) { std::ofstream(to) << json; };
  write(path, {{"psnr", 27}, {"settings", train::to_json(then)}, {"dataset", first.dataset_note()}});
  write(bare, train::to_json(then));

  // A goal beside a record goes on with the same words.
  const std::vector<std::string> plain = {"--preset", "fast", "--steps", "700"};
  write(bare, train::to_json(line_of(plain).settings(scene)));
  const std::vector<std::string> goal = {"--settings", bare, "--target-psnr", "28"};
  CHECK_NOTHROW(resumed(goal, goal, synthetic));
  write(bare, train::to_json(then));

  CommandLine again = line_of({"--settings", path});
  CHECK(differences(then, again.settings(scene)).empty());
  CHECK((again.load.downscale == 2 && again.load.alpha == scene::AlphaUse::mask));
  CHECK(differences(then, line_of({"--settings", bare}).settings(scene)).empty());
  CHECK(line_of({"--settings", bare}).load.downscale == 1);
  again = line_of(
      {"--settings", path, "--steps", "900", "--set", "huber=0", "-r", "1", "--set", "lr_end=0.5", "--recipe", "real"});
  train::Settings other = then;
  other.steps = 900, other.huber = 0, other.lr_end = 0.5, other.recipe = train::Recipe::real;
  CHECK(differences(other, again.settings(scene)).empty());
  CHECK(again.settings(scene).recipe == train::Recipe::real);
  CHECK(again.load.downscale == 1);
  // Goes on with it, and says what differs.
  train::CheckpointInfo info{300, then, first.note(), 0};
  CommandLine resumed = line_of({"--settings", path});
  resumed.take(info.note, "c");
  CHECK(differences(then, resumed.resumed(info, scene, "c")).empty());
  resumed = line_of({"--settings", path, "--set", "huber=0.1"});
  CHECK_THROWS_WITH(resumed.resumed(info, scene, "c"), Catch::Contains("`huber` 0.3 (now 0.1)"));
  other = then;
  other.seed = 9;
  write(bare, train::to_json(other));
  CHECK_THROWS_WITH(line_of({"--settings", bare}).resumed(info, scene, "c"), Catch::Contains("`seed` 0 (now 9)"));

  const auto refused = [&](const nlohmann::json& json, const std::string& what) {
    write(path, json);
    CHECK_THROWS_WITH(read_settings_file(path), Catch::Contains(path) && Catch::Contains(what));
  };
  nlohmann::json settings = train::to_json(then);
  settings["pixel_jiter"] = 0.2;
  refused({{"settings", settings}}, "unknown setting 'pixel_jiter'; the nearest is pixel_jitter");
  settings.erase("pixel_jiter");
  settings["steps"] = -1;
  refused(settings, "`steps` is -1; it must be a whole number");
  settings["steps"] = 5, settings["pixel_jitter"] = 0.75;
  refused(settings, "`pixel_jitter` is 0.75; it must be");
  settings.erase("steps");
  refused(settings, "steps");
  refused(nlohmann::json::array(), "no settings of a training");
  std::ofstream(path) << std::string(100'000, '[');
  CHECK_THROWS_WITH(read_settings_file(path), Catch::Contains("nested deeper"));
  std::ofstream(path) << "{";
  CHECK_THROWS_WITH(read_settings_file(path), Catch::Contains("not JSON"));
}

TEST_CASE("a value that a setting cannot have names its option", "[command_line]") {
  const auto said = [](std::vector<std::string> options) {
    CommandLine line;
    options.insert(options.begin(), {"soup-train", "scene", "-o", "out"});
    std::vector<char*> argv;
    for (std::string& word : options) argv.push_back(word.data());
    std::fflush(stderr);
    const test::TemporaryFolder folder;
    const std::string path = (folder.path() / "stderr").string();
    const int before = dup(2);
    REQUIRE(std::freopen(path.c_str(), "w", stderr));
    const auto status = parse(static_cast<int>(argv.size()), argv.data(), line);
    std::fflush(stderr);
    dup2(before, 2);
    close(before);
    CHECK(status == 1);
    return read_file(path);
  };
  using Catch::Equals;
  CHECK_THAT(said({"--steps", "0"}), Equals("soup-train: --steps is 0; it must be a whole number from 1 on\n"));
  CHECK_THAT(said({"--set", "huber=-1"}), Equals("soup-train: --set huber is -1; it must be a number from 0 on\n"));
  CHECK_THAT(said({"--set", "triangles=7"}), Equals("soup-train: --set triangles=7: use the option --triangles\n"));
  CHECK_THAT(said({"--max-mb", "2e9"}), Catch::Contains("--max-mb: '2e9' is not a file size in megabytes"));
  CHECK_THAT(said({"--exposure=perhaps"}), Catch::Contains("--exposure is perhaps; it must be true or false"));
  // --set takes one word, wherever it stands.
  std::vector<std::string> words{"soup-train", "scene", "--set", "huber=0", "--set", "batch=2", "-o", "out"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  CommandLine line;
  REQUIRE_FALSE(parse(static_cast<int>(argv.size()), argv.data(), line).has_value());
  CHECK(line.request.assignments.size() == 2);
}
