#include "run/presets.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/printable.h"
#include "train/start/start_points.h"

namespace trisoup::train {

namespace {

/// The median training photograph has at least 200,000 pixels: then half its sides are enough for most steps. With a
/// fourth of that they are not (docs/decisions.md).
bool has_large_photographs(const scene::Scene& scene) {
  constexpr std::uint64_t kLarge = 200'000;
  std::vector<std::uint64_t> pixels;
  for (const scene::View& view : scene.train) pixels.push_back(std::uint64_t(view.camera.width) * view.camera.height);
  if (pixels.empty()) return false;
  std::nth_element(pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(pixels.size() / 2), pixels.end());
  return pixels[pixels.size() / 2] >= kLarge;
}

/// What a start that covers the scene in its colours asks for: docs/method.md, "Start".
void start_from_surface(Settings& s, const scene::Scene& scene, bool as_published) {
  s.init_count = s.triangles;
  const Reach reach = reach_of(scene);
  s.far = std::max(s.far, 3.3 * reach.farthest);
  if (as_published) return;
  s.backdrop = 3.0 * reach.farthest;
  s.near = s.test_near = reach.nearest;
  s.init_opacity = 0.9;
  s.coarse_share = 0;
  if (has_large_photographs(scene)) s.small_share = 0.75;
  s.paint = true;
  s.keep_opacity = true;
  s.rate_texture = 0.1;
  // Where vertices have found their place, going on opens cracks.
  s.rate_vertex_end = 0.03;
  s.rest_share = 0.2;
  // Splits take the room of what no view shows, and no more: what they make beyond the budget has to go again, and
  // leaves its place open.
  s.most_triangles = s.triangles;
  s.fill_budget = true;
  s.resample_until = 0.5;
}

}  // namespace

bool wants_points(const PresetChoice& choice, const scene::Scene& scene) {
  if (!choice.init.empty()) return choice.init == "surface" || choice.init == "points";
  return choice.preset != "published" && !scene.synthetic;
}

Settings of_preset(const PresetChoice& choice, const scene::Scene& scene) {
  constexpr std::array<std::string_view, 5> kPresets = {"", "fast", "balanced", "best", "published"};
  if (std::find(kPresets.begin(), kPresets.end(), choice.preset) == kPresets.end())
    throw Error("preset: there is no '{}'; give fast, balanced, best or published", printable(choice.preset));
  const Recipe which = choice.recipe ? *choice.recipe : scene.synthetic ? Recipe::synthetic : Recipe::real;
  Settings s = published(which);
  const bool as_published = choice.preset == "published";
  if (as_published)
    s = without_our_changes(s);
  else {
    // Points of the Pareto front in docs/benchmarks.md, "Training time". All of its trainings share these rates.
    s.rate_end = s.rate_vertex_end = 0.1;
    s.huber = 0.1;
    s.texture_bits = 6;
    s.knee = 0.2;
    // Pictures that were rendered have one exposure.
    s.exposure = which == Recipe::real;
    if (which == Recipe::synthetic) s.init_count = 30'000;
  }
  if (choice.preset == "fast") s.steps = 1000, s.triangles = 2000, s.init_count = 10'000, s.level_max = 4;
  if (choice.preset == "balanced") s.steps = 3000, s.triangles = 5000, s.init_count = 10'000, s.level_max = 4;

  const bool has_points = !scene.points.positions.empty();
  s.init = !choice.init.empty() ? choice.init : !has_points ? "random" : as_published ? "points" : "surface";
  // Random triangles get further by many steps of few views; from a surface that brings nothing (docs/decisions.md).
  if (choice.preset == "fast" && which == Recipe::synthetic && s.init == "random") s.steps *= 2, s.batch /= 2;
  if (choice.steps) s.steps = *choice.steps;
  s.resample_every = std::max<std::uint64_t>(100, s.steps / 100);
  if (choice.triangles) s.triangles = *choice.triangles;
  if (s.init == "surface") start_from_surface(s, scene, as_published);
  if (s.init == "random" && which == Recipe::real) {
    // Nothing is known of where a real scene's surfaces are: the whole room between the cameras.
    s.init_box = 1.0;
    s.init_radius = 0.01;
    s.init_count = std::max<std::uint32_t>(s.init_count, 30'000);
  }
  // What the cloud shows should not be cut off; beyond the limit are strays.
  constexpr double kFarthest = 1e4;
  if (which == Recipe::real)
    for (const glm::vec3& p : scene.points.positions)
      if (const double reach = 1.1 * glm::length(p); reach < kFarthest) s.far = std::max(s.far, reach);
  return s;
}

double preset_vertex_rate(const PresetChoice& choice, const Settings& s) {
  if (choice.preset == "published") return std::max(s.rate_vertex, vertex_rate(s, published_way(s.recipe)));
  return s.recipe == Recipe::synthetic ? vertex_rate(s, 1.5, kFastestSynthetic) : vertex_rate(s, 4.0, kFastestVertices);
}

}  // namespace trisoup::train
