// Tests trainer/command_line.h: what options and presets come to.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "train/settings.h"
#include "trainer/command_line.h"

using namespace trisoup;

namespace {

train::Settings settings_of(std::vector<std::string> options, bool synthetic) {
  options.insert(options.begin(), {"soup-train", "scene", "-o", "out"});
  std::vector<char*> argv;
  for (std::string& word : options) argv.push_back(word.data());
  CommandLine line;
  REQUIRE_FALSE(parse(static_cast<int>(argv.size()), argv.data(), line).has_value());
  scene::Scene scene;
  scene.synthetic = synthetic;
  return line.settings(scene);
}

double way(const train::Settings& s) {
  double sum = 0;
  for (std::uint64_t step = 1; step <= s.steps; ++step) sum += s.rate_vertex * train::rate_factor(s, step);
  return sum;
}

}  // namespace

TEST_CASE("without options the settings are the published ones", "[command_line]") {
  for (const bool synthetic : {true, false}) {
    const train::Settings published = train::published(synthetic ? train::Recipe::synthetic : train::Recipe::real);
    for (const train::Settings& s : {settings_of({}, synthetic), settings_of({"--preset", "best"}, synthetic)}) {
      CHECK(s.steps == 10'000);
      CHECK(s.triangles == 15'000);
      CHECK(s.rate_vertex == published.rate_vertex);
      CHECK(s.rate_end == published.rate_end);
      CHECK(s.samples_per_pixel == 1);  // not as published, and the option says so
      CHECK(settings_of({"--samples-per-pixel", "0"}, synthetic).samples_per_pixel == 0);
      CHECK(s.pixel_jitter == 0.25);  // likewise
      CHECK(settings_of({"--pixel-jitter", "0"}, synthetic).pixel_jitter == 0);
      CHECK_THROWS_WITH(settings_of({"--pixel-jitter", "1.5"}, synthetic), Catch::Contains("--pixel-jitter"));
    }
    // More steps than published do not slow vertices down.
    CHECK(settings_of({"--steps", "30000"}, synthetic).rate_vertex == published.rate_vertex);
  }
}

TEST_CASE("few steps have the published way of vertices, presets their own", "[command_line]") {
  CHECK(way(settings_of({"--steps", "1000"}, true)) == Approx(0.537).epsilon(0.01));
  CHECK(settings_of({"--steps", "1000"}, false).rate_vertex == train::kFastestVertices);
  CHECK(way(settings_of({"--steps", "5000"}, false)) == Approx(5.37).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast"}, true)) == Approx(1.5).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast", "--steps", "700", "--rate-end", "0.5"}, true)) == Approx(1.5).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "balanced"}, false)) == Approx(4.0).epsilon(0.01));
  CHECK(way(settings_of({"--preset", "fast", "--recipe", "synthetic"}, false)) == Approx(1.5).epsilon(0.01));
  CHECK(settings_of({"--preset", "fast"}, true).rate_end == 0.1);
  CHECK(settings_of({"--preset", "fast", "--rate-vertex", "0.02"}, true).rate_vertex == 0.02);
  CHECK(settings_of({"--rate-vertex", "0.00025", "--steps", "1000"}, true).rate_vertex == 0.00025);
}
