// Tests trainer/command_line.h: what options and presets come to.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "train/settings.h"
#include "trainer/command_line.h"

using namespace trisoup;

namespace {

train::Settings settings_of(std::vector<std::string> options, bool synthetic, bool points = false) {
  options.insert(options.begin(), {"soup-train", "scene", "-o", "out"});
  std::vector<char*> argv;
  for (std::string& word : options) argv.push_back(word.data());
  CommandLine line;
  REQUIRE_FALSE(parse(static_cast<int>(argv.size()), argv.data(), line).has_value());
  scene::Scene scene;
  scene.synthetic = synthetic;
  for (int i = 0; points && i < 8; ++i) scene.points.positions.emplace_back(i & 1, i & 2, i & 4);
  return line.settings(scene);
}

double way(const train::Settings& s) {
  double sum = 0;
  for (std::uint64_t step = 1; step <= s.steps; ++step) sum += s.rate_vertex * train::vertex_rate_factor(s, step);
  return sum;
}

}  // namespace

TEST_CASE("without options the settings are the best preset's", "[command_line]") {
  for (const bool synthetic : {true, false})
    for (const train::Settings& s : {settings_of({}, synthetic), settings_of({"--preset", "best"}, synthetic)}) {
      CHECK(s.steps == 10'000);
      CHECK(s.triangles == 15'000);
      CHECK(s.level_max == 5);
      CHECK(s.samples_per_pixel == 1);
      CHECK(s.pixel_jitter == 0.25);
      CHECK(s.opacity_baseline);
      CHECK(s.least_views == 4);
      CHECK(s.exposure == !synthetic);
      CHECK_FALSE((s.copy_textures || s.drop_near || s.update_unseen));
      CHECK((s.rate_end == 0.1 && s.rate_vertex_end == 0.1 && s.huber == 0.1));
      CHECK(way(s) == Approx(synthetic ? 1.5 : 4.0).epsilon(0.01));
      CHECK(s.init_count == 30'000);
    }
  CHECK(settings_of({"--samples-per-pixel", "0"}, true).samples_per_pixel == 0);
  CHECK(settings_of({"--pixel-jitter", "0"}, true).pixel_jitter == 0);
  CHECK_THROWS_WITH(settings_of({"--pixel-jitter", "0.6"}, true), Catch::Contains("--pixel-jitter"));
  CHECK_FALSE(settings_of({"--no-opacity-baseline"}, true).opacity_baseline);
  CHECK(settings_of({"--copy-textures"}, true).copy_textures);
  CHECK(settings_of({"--drop-near"}, true).drop_near);
  CHECK(settings_of({"--update-unseen"}, true).update_unseen);
  CHECK(settings_of({"--exposure"}, true).exposure);
  CHECK_FALSE(settings_of({"--exposure=false"}, false).exposure);
}

TEST_CASE("as published is everything that has an option", "[command_line]") {
  for (const bool synthetic : {true, false}) {
    const train::Settings published = train::published(synthetic ? train::Recipe::synthetic : train::Recipe::real),
                          s = settings_of({"--preset", "published"}, synthetic);
    CHECK(s.steps == 10'000);
    CHECK(s.triangles == 15'000);
    CHECK(s.level_max == 5);
    CHECK(s.init_count == (synthetic ? 100'000 : 30'000));  // of a real one without points
    CHECK(s.rate_vertex == published.rate_vertex);
    CHECK((s.rate_end == 0.01 && s.rate_vertex_end == 0.01 && s.huber == 0));
    CHECK(s.samples_per_pixel == 0);
    CHECK(s.pixel_jitter == 0);
    CHECK(s.least_views == 0);
    CHECK_FALSE((s.opacity_baseline || s.exposure));
    CHECK(settings_of({"--preset", "published", "--exposure"}, synthetic).exposure);
    CHECK((s.copy_textures && s.drop_near && s.update_unseen));
    // More steps than published do not slow vertices down.
    CHECK(settings_of({"--preset", "published", "--steps", "30000"}, synthetic).rate_vertex == published.rate_vertex);
    // Each can be had back.
    const train::Settings back = settings_of({"--preset", "published", "--pixel-jitter", "0.5", "--copy-textures=false", "--drop-near=false",
                                              "--update-unseen=false", "--no-opacity-baseline=false", "--least-views", "3"}, synthetic);
    CHECK(back.pixel_jitter == 0.5);
    CHECK(back.opacity_baseline);
    CHECK_FALSE((back.copy_textures || back.drop_near || back.update_unseen));
    CHECK(back.least_views == 3);
    // Of a flag given twice the last counts.
    CHECK(settings_of({"--copy-textures=false", "--copy-textures"}, synthetic).copy_textures);
    CHECK_FALSE(settings_of({"--copy-textures", "--copy-textures", "--copy-textures=false"}, synthetic).copy_textures);
    CHECK(settings_of({"--no-opacity-baseline", "--no-opacity-baseline", "--no-opacity-baseline=false"}, synthetic).opacity_baseline);
  }
}

TEST_CASE("few steps have the published way of vertices, presets their own", "[command_line]") {
  CHECK(way(settings_of({"--preset", "published", "--steps", "1000"}, true)) == Approx(0.537).epsilon(0.01));
  CHECK(settings_of({"--preset", "published", "--steps", "1000"}, false).rate_vertex == train::kFastestVertices);
  CHECK(way(settings_of({"--preset", "published", "--steps", "5000"}, false)) == Approx(5.37).epsilon(0.01));
  CHECK(way(settings_of({"--steps", "5000"}, false)) == Approx(4.0).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast"}, true)) == Approx(1.5).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast", "--steps", "700", "--rate-end", "0.5"}, true)) == Approx(1.5).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "balanced"}, false)) == Approx(4.0).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast", "--recipe", "synthetic"}, false)) == Approx(1.5).epsilon(0.01));
  CHECK(settings_of({"--preset", "fast"}, true).rate_end == 0.1);
  // --rate-end is for all rates, --rate-vertex-end for vertices alone.
  CHECK(settings_of({"--rate-end", "0.2"}, true).rate_vertex_end == 0.2);
  const train::Settings own = settings_of({"--rate-end", "0.2", "--rate-vertex-end", "0.05", "--huber", "0.3"}, true);
  CHECK((own.rate_end == 0.2 && own.rate_vertex_end == 0.05 && own.huber == 0.3));
  CHECK(way(own) == Approx(1.5).epsilon(0.01));
}

TEST_CASE("from a surface vertices come to rest before textures do", "[command_line]") {
  const train::Settings s = settings_of({"--preset", "balanced"}, false, true);
  REQUIRE(s.init == "surface");
  CHECK((s.rate_end == 0.1 && s.rate_vertex_end == 0.03 && s.huber == 0.1));
  CHECK(way(s) == Approx(4.0).epsilon(0.01));
  CHECK(settings_of({"--rate-end", "0.5"}, false, true).rate_vertex_end == 0.5);
  CHECK(settings_of({"--rate-vertex-end", "0.5"}, false, true).rate_vertex_end == 0.5);
  CHECK(settings_of({"--preset", "published"}, false, true).rate_vertex_end == 0.01);
  CHECK((s.rest_share == 0.2 && settings_of({"--rest-share", "0"}, false, true).rest_share == 0));
  CHECK((settings_of({"--preset", "published"}, false, true).rest_share == 0 && settings_of({}, true).rest_share == 0));
  // Nor has it a coarse part, but the photographs' colours.
  CHECK((s.paint && s.coarse_share == 0 && !settings_of({"--paint=false"}, false, true).paint));
  CHECK((!settings_of({"--preset", "published"}, false, true).paint && settings_of({}, true).coarse_share == 0.5));
  // Its budget is filled.
  CHECK((s.fill_budget && !settings_of({"--fill-budget=false"}, false, true).fill_budget));
  CHECK_FALSE((settings_of({}, false).fill_budget || settings_of({"--preset", "published"}, false, true).fill_budget));
  CHECK(settings_of({"--preset", "fast", "--rate-vertex", "0.02"}, true).rate_vertex == 0.02);
  CHECK(settings_of({"--rate-vertex", "0.00025", "--steps", "1000"}, true).rate_vertex == 0.00025);
}
