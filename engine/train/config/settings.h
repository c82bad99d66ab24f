// Everything that decides what a training computes. Names, bounds, defaults and help: settings_table.h.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace trisoup::train {

/// How triangles are dropped and split (docs/method.md, "Refinement").
enum class Recipe {
  synthetic,  // drops triangles that no view shows; bisects the longest edges, in world units, up to the budget
  real        // drops the least visible triangles down to the budget; bisects edges that are long on the screen
};

/// Lengths and `lr_vertex` are in normalised units: the cameras' mean distance from the scene's centre is 1. The
/// defaults are the published values of synthetic scenes in these units (docs/method.md, "Units").
struct Settings {
  Recipe recipe = Recipe::synthetic;
  bool published = false;  // do as the publication does wherever this project's method differs from it
  std::uint64_t steps = 10'000;
  std::uint32_t triangles = 15'000;  // budget; of a surface start with `least_shift` the ceiling of the budget
  std::uint32_t batch = 4;           // views per step
  std::uint64_t seed = 0;

  std::string init;                     // "surface", "random", "points" or the path of a mesh file
  std::string removed_from = {};        // path of the model from which `init` was cut; empty: of none
  std::uint32_t init_count = 0;         // triangles at the start
  std::array<double, 3> init_centre{};  // centre of the box of a random start
  double init_box = 0.3;                // half the side of that box
  double init_radius = 0.0025;          // circumradius of the triangles of a random start
  double init_opacity = 0.5;
  /// Mean squared shift of the photographs' pixels, in pixels^2, that one more triangle of a surface start must save;
  /// 0: the start has `triangles`. Otherwise it has an eighth of them at least.
  double least_shift = 0;
  double backdrop = 0;  // radius of a sphere of triangles around everything else, which refinement never drops; 0: none

  double lr_texture = 5e-2, lr_mlp = 1e-2, lr_vertex = 2.5e-4;  // learning rates at the first step
  double lr_end = 0.01;         // learning rates of textures and MLP at the last step, as a share of the first
  double lr_vertex_end = 0.01;  // the same of vertices
  double lr_vertex_side = 0;    // triangles with a smaller side have vertex learning rates in proportion to it; 0: none
  double lr_vertex_distance = 0;  // vertices nearer to a camera have learning rates in proportion to it; 0: none
  double huber = 0;               // colour errors below it have a gradient in proportion to them (Huber); 0: L1

  double lambda_depth = 0;   // weight of the depth loss at the first step; it falls to 0 (docs/method.md, "Depth maps")
  double depth_until = 0.7;  // share of the steps after which it is 0

  std::uint32_t level_min = 2, level_max = 5;  // texture levels after the coarse part
  double samples_per_pixel = 1;     // of a triangle's finest level, where photographs show it largest; 0: level_max
  std::uint32_t texture_bits = 8;   // bits of each texture value in the model file; 8: exact
  double coarse_share = 0.5;        // first share of the steps, which trains textures of level 0 alone
  double small_share = 0;           // first share of the steps, which trains on smaller pictures
  double pixel_jitter = 0.25;       // largest distance of samples from pixel centres, pixels along each axis
  double random_background = 0;     // share of views that steps see on random backgrounds, if photographs have alpha
  double neighbour_directions = 0;  // share of views that steps shade as the nearest cameras would see them
  bool exposure = false;            // finds an exposure of each photograph (docs/method.md, "Exposure")
  bool pose_corrections = false;    // corrects the poses of training cameras (docs/method.md, "Poses")
  double pose_motion = 0.25;        // pixels; with a smaller median of the first corrections there are none
  std::uint64_t pose_every = 0;     // steps between corrections; 0: none
  bool opaque = false;              // opacity is fixed to 1: no masking and no gradient of it

  std::uint64_t refine_every = 100;  // steps
  double refine_until = 0.95;        // share of the steps
  double split_length = 0.2;         // longest edge as a share of the image height (real)
  std::uint32_t most_triangles = 0;  // ceiling of splits beyond the budget (real); 0: what fits in memory
  double knee = 0;                   // dB; pruning removes what would gain less for twice the samples; 0: no pruning

  // Goals of simplifying (topology/simplify.h); 0: none. Qualities are means over the validation views.
  double target_psnr = 0, target_ssim = 0;
  std::uint64_t max_bytes = 0;  // of the model file
  std::uint32_t max_triangles = 0;
  std::uint32_t validation_views = 0;  // held out of the training views, spread evenly over them in name order; 0: none
  std::uint64_t round_steps = 0;       // steps after each removal

  double near = 0.025, far = 2.5;  // clip planes of training
  double test_near = 0.025;        // near plane of test views

  std::uint64_t eval_every = 0;  // steps; 0: at the end only
  std::uint64_t checkpoint_every = 1000;
};

/// Whether the start covers everything that the photographs show, in their colours. Such a training paints its textures
/// from the photographs, keeps opacities, splits up to the budget and lets vertices come to rest at its end.
bool starts_from_surface(const Settings& settings);

/// Whether the surface that a training starts from decides on the budget, up to `triangles`.
bool surface_decides_budget(const Settings& settings);
/// Changes the budget, and with it what presets derive from it where a training starts from a surface.
void set_budget(Settings& settings, std::uint32_t triangles);

/// Throws Error, which names the setting in backquotes and its bounds, on values that no training can have.
void check(const Settings& settings);

/// "`seed` 0 (now 5), `steps` 100 (now 50)": the settings that differ. Empty if none does.
std::string differences(const Settings& before, const Settings& now);

nlohmann::json to_json(const Settings& settings);
/// Throws Error if a setting is missing, or has a value of another type.
Settings settings_from_json(const nlohmann::json& json);
/// The same for settings that a training was run with: throws Error also on values that check() refuses.
Settings checked_settings_from_json(const nlohmann::json& json);

const char* to_string(Recipe recipe);

}  // namespace trisoup::train
