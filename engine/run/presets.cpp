#include "run/presets.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>

#include "base/error.h"
#include "base/printable.h"
#include "scene/hold_out.h"
#include "train/config/schedule.h"
#include "train/start/start_points.h"
#include "train/topology/simplify.h"

namespace trisoup::train {
namespace {

/// The median training photograph has at least 200,000 pixels: then half its sides are enough for most steps. With a
/// fourth of these pixels they are not (docs/decisions.md).
bool has_large_photographs(const scene::Scene& scene) {
  constexpr std::uint64_t kLarge = 200'000;
  std::vector<std::uint64_t> pixels;
  for (const scene::View& view : scene.train) pixels.push_back(std::uint64_t(view.camera.width) * view.camera.height);
  if (pixels.empty()) return false;
  std::nth_element(pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(pixels.size() / 2), pixels.end());
  return pixels[pixels.size() / 2] >= kLarge;
}

std::optional<Column> column_of(const std::string& preset) {
  if (preset == "fast") return Column::fast;
  if (preset == "balanced") return Column::balanced;
  if (preset == "published") return Column::published;
  if (preset.empty() || preset == "best") return Column::usual;
  return std::nullopt;
}

template <typename T>
std::optional<T> asked_for(const SettingsRequest& request, std::string_view setting) {
  const SettingValue* const value = request.find(setting);
  return value ? std::optional<T>(std::get<T>(*value)) : std::nullopt;
}

/// Clip planes and the number of first triangles, which depend on the kind of scene.
void set_recipe(Settings& s, Column preset) {
  const bool is_published = preset == Column::published;
  s.init_count = s.recipe == Recipe::real ? 15'000 : is_published ? 100'000 : 30'000;
  if (s.recipe == Recipe::synthetic) return;
  s.lr_vertex = 2.5e-3;
  s.near = 0.0025;
  s.far = 100.0;  // a real scene has no bounds; far is only where depth ends
  s.test_near = 0.125;
  s.exposure = !is_published;
}

void start_from_surface(Settings& s, const scene::Scene& scene) {
  s.init_count = s.triangles;
  const Reach reach = reach_of(scene);
  s.far = std::max(s.far, 3.3 * reach.farthest);
  if (s.published) return;
  set_defaults(s, Column::surface);
  // Its triangles are where they belong, so a few refinements do (docs/decisions.md).
  s.refine_every = std::max(s.refine_every, s.steps / 10);
  s.backdrop = 3.0 * reach.farthest;
  s.near = s.test_near = reach.nearest;
  if (has_large_photographs(scene)) s.small_share = 0.75;
  // Splits only fill the room of triangles that no view shows. What they added beyond the budget would be dropped
  // again, and would leave holes.
  s.most_triangles = s.triangles;
}

/// Nothing is known about where a real scene's surfaces are: triangles fill the room between the cameras.
void start_at_random_in_real_scene(Settings& s) {
  s.init_box = 1.0;
  s.init_radius = 0.01;
  s.init_count = std::max<std::uint32_t>(s.init_count, 30'000);
}

/// Moves the far plane behind the cloud. Points beyond a limit are strays.
void reach_all_points(Settings& s, const scene::Scene& scene) {
  constexpr double kFarthest = 1e4;
  for (const glm::vec3& p : scene.points.positions)
    if (const double reach = 1.1 * glm::length(p); reach < kFarthest) s.far = std::max(s.far, reach);
}

/// The preset's settings with those of the request that others follow from: recipe, start, steps and budget.
Settings preset_settings(const SettingsRequest& request, const scene::Scene& scene) {
  const std::optional<Column> preset = column_of(request.preset);
  if (!preset)
    throw Error("preset: there is no '{}'; give fast, balanced, best or published", printable(request.preset));
  Settings s;
  const auto recipe = asked_for<std::string>(request, "recipe");
  s.recipe = (recipe ? *recipe == "synthetic" : scene.synthetic) ? Recipe::synthetic : Recipe::real;
  set_defaults(s, Column::usual);
  set_recipe(s, *preset);
  set_defaults(s, *preset);
  const bool has_points = !scene.points.positions.empty();
  s.init = asked_for<std::string>(request, "init")
               .value_or(!has_points   ? "random"
                         : s.published ? "points"
                                       : "surface");
  // Many steps of few views get further from random triangles; from a surface they gain nothing (docs/decisions.md).
  if (preset == Column::fast && s.recipe == Recipe::synthetic && s.init == "random") s.steps *= 2, s.batch /= 2;
  s.steps = asked_for<std::uint64_t>(request, "steps").value_or(s.steps);
  s.refine_every = std::max<std::uint64_t>(100, s.steps / 100);
  const auto triangles = asked_for<std::uint64_t>(request, "triangles");
  if (triangles) s.triangles = static_cast<std::uint32_t>(*triangles);
  if (triangles || s.init != "surface") s.least_shift = 0;
  s.least_shift = asked_for<double>(request, "least_shift").value_or(s.least_shift);
  if (!triangles && surface_decides_budget(s)) s.triangles *= 4;
  if (s.init == "surface") start_from_surface(s, scene);
  if (s.init == "random" && s.recipe == Recipe::real) start_at_random_in_real_scene(s);
  if (s.recipe == Recipe::real) reach_all_points(s, scene);
  return s;
}

std::string absolute(const std::string& path) {
  std::error_code failed;
  const std::filesystem::path whole = std::filesystem::absolute(path, failed).lexically_normal();
  return failed ? path : whole.string();
}

/// Whether poses may be a little off. Points that fit their photographs within half a pixel say that they are not.
bool may_correct_poses(const Settings& s, const scene::Scene& scene) {
  constexpr double kGood = 0.5;  // mean reprojection error, pixels
  if (s.published || s.recipe == Recipe::synthetic) return false;
  double sum = 0, known = 0;
  for (const float error : scene.points.errors)
    if (error >= 0) sum += static_cast<double>(error), ++known;
  return known == 0 || sum >= kGood * known;
}

/// The steps that show every photograph about once. Fewer than a hundred corrections are enough.
std::uint64_t default_pose_every(const Settings& s, const scene::Scene& scene) {
  const std::uint64_t all = (scene.train.size() + s.batch - 1) / s.batch;
  return std::max<std::uint64_t>({1, all, s.steps / 100});
}

double default_vertex_lr(const Settings& s) {
  if (s.published) return std::max(s.lr_vertex, vertex_lr(s, published_travel(s.recipe)));
  return s.recipe == Recipe::synthetic ? vertex_lr(s, 1.5, kMaxVertexLrSynthetic) : vertex_lr(s, 4.0, kMaxVertexLr);
}

}  // namespace

const SettingValue* SettingsRequest::find(std::string_view setting) const {
  for (auto it = assignments.rbegin(); it != assignments.rend(); ++it)
    if (it->setting->name == setting) return &it->value;
  return nullptr;
}

bool start_needs_points(const std::string& init, const scene::Scene& scene) {
  return init == "surface" || (init == "points" && scene.points.positions.empty());
}

bool wants_points(const SettingsRequest& request, const scene::Scene& scene) {
  if (const auto init = asked_for<std::string>(request, "init")) return start_needs_points(*init, scene);
  return request.preset != "published" && !scene.synthetic;
}

void apply(const SettingsRequest& request, const scene::Scene& scene, Settings& s) {
  for (const Assignment& assignment : request.assignments) assign(s, assignment);
  const double unit = scene.normalisation.scale;
  if (const auto box = asked_for<double>(request, "init_box")) {
    const glm::dvec3 origin = scene.normalisation.to_normalised(glm::dvec3(0.0));
    s.init_centre = {origin.x, origin.y, origin.z};
    s.init_box = *box * unit;
  }
  if (const auto radius = asked_for<double>(request, "init_radius")) s.init_radius = *radius * unit;
  if (s.removed_from.empty()) return;
  // Absolute: both models are read again when the training goes on or is scored, from any folder.
  if (request.has("removed_from")) s.removed_from = absolute(s.removed_from);
  if (request.has("init") && std::filesystem::path(s.init).has_extension()) s.init = absolute(s.init);
}

Settings make_settings(const SettingsRequest& request, const scene::Scene& scene) {
  Settings s = preset_settings(request, scene);
  apply(request, scene, s);
  if (request.has("lr_end") && !request.has("lr_vertex_end")) s.lr_vertex_end = s.lr_end;
  if (!request.has("lr_vertex")) s.lr_vertex = default_vertex_lr(s);
  if (!request.has("pose_corrections")) s.pose_corrections = may_correct_poses(s, scene);
  if (request.has("pose_corrections") && !request.has("pose_motion")) s.pose_motion = 0;
  if (!request.has("pose_every") && s.pose_corrections) s.pose_every = default_pose_every(s, scene);
  return s;
}

void complete_goal(const SettingsRequest& request, const scene::Scene& scene, bool lowers_knee, Settings& s) {
  if (!has_goal(s)) return;
  const bool has_quality = s.target_psnr > 0 || s.target_ssim > 0;
  // A quality may lie above the usual knee. Training repairs what pruning costs; removals after it are hardly repaired.
  constexpr double kKneeBeforeGoal = 0.05;  // dB
  if (has_quality && lowers_knee && !request.has("knee")) s.knee = std::min(s.knee, kKneeBeforeGoal);
  // A ceiling alone needs no views to measure it.
  if (has_quality && s.validation_views == 0 && !request.has("validation_views"))
    s.validation_views = static_cast<std::uint32_t>(scene::usual_validation_views(scene));
  if (!request.has("round_steps") && s.round_steps == 0) s.round_steps = std::max<std::uint64_t>(20, s.steps / 20);
}

}  // namespace trisoup::train
