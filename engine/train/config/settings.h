// Everything that decides what a training run computes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace trisoup::train {

/// How triangles are dropped and added (docs/method.md, "Resampling").
enum class Recipe {
  synthetic,  // drop what is never seen, bisect the longest world edges up to the budget
  real        // drop the least seen down to the budget, bisect edges that are long on the screen
};

/// Lengths and the vertex rate are in normalised units: the cameras are at mean distance 1 from the scene's centre. The
/// defaults are the published values, brought to those units (docs/method.md, "Units").
struct Settings {
  Recipe recipe = Recipe::synthetic;
  std::uint64_t steps = 10'000;
  std::uint32_t triangles = 15'000;  // budget
  std::uint32_t batch = 4;           // views per step
  std::uint64_t seed = 0;

  std::string init;                     // "surface", "random", "points" or a mesh file
  std::uint32_t init_count = 0;         // triangles at the start
  std::array<double, 3> init_centre{};  // of the box of a random start
  double init_box = 0.3;                // half its side
  double init_radius = 0.0025;          // circumradius of a random start's triangles
  double init_opacity = 0.5;            // of all triangles at the start
  double backdrop = 0;  // radius of a sphere of triangles around all else that no change of topology drops; 0: none

  double rate_texture = 5e-2, rate_mlp = 1e-2, rate_vertex = 2.5e-4;
  double rate_end = 0.01;         // rates of textures and MLP are multiplied by rate_end^(step / steps)
  double rate_vertex_end = 0.01;  // that of vertices by rate_vertex_end^(step / steps)
  double rest_share =
      0;             // of the steps, the last ones: in them the rate of vertices falls to nothing besides, linearly
  double huber = 0;  // colour errors below it pull in proportion to their size; 0: all alike, as published

  std::uint32_t texture_bits =
      8;  // of each of a texture's values, and of the plain colours, in the model file; 8: as published

  std::uint32_t coarse_level = 0;  // the only level of the first part
  std::uint32_t level_min = 2, level_max = 5;
  double samples_per_pixel =
      1;  // of a triangle's finest level, where photographs show it largest; 0: level_max for all, as published
  double pixel_jitter =
      0.25;  // how far from pixel centres a step samples, at most, in pixels; 0: at the centres, as published
  double coarse_share = 0.5;  // of the steps
  double small_share =
      0;  // of the steps, the first ones, which look at smaller pictures; the coarse part does so anyway
  double small_scale = 0.5;  // their sides, as a share of the photographs'; 1: as published
  bool paint =
      false;  // a start with colours has the photographs' in its fine levels; only where there is no coarse part
  bool keep_opacity = false;  // through the change from coarse to fine
  bool keep_moments = false;  // of textures, through resampling
  bool opacity_baseline =
      true;                    // opacities learn from errors against those of the pixels around; published: from errors
  bool update_unseen = false;  // values of textures without a gradient go on by their moments, as published
  bool drop_near = false;      // triangles that reach the camera plane are dropped whole, as published, not clipped
  bool exposure = false;       // photographs have gains and offsets of their own (docs/method.md, "Exposure")
  bool opaque = false;         // opacity fixed to 1: no masking, and no gradient of it
  bool copy_textures = false;  // children take copies of their parent's texture, as published, not their part of it

  std::uint64_t resample_every = 100;  // steps
  double resample_until = 0.95;        // share of the steps
  std::uint32_t split_views = 20;      // views in which edges are measured (real)
  double split_length = 0.2;           // longest edge, of the image height (real)
  bool fill_budget = false;            // the triangles that photographs show largest are split up to the budget (real)
  std::uint32_t least_views =
      4;  // triangles that fewer training views show are dropped; at most a tenth of the views; 0: as published (real)
  std::uint32_t most_triangles = 0;  // how far splitting goes beyond the budget (real); 0: as far as memory lets it
  double count_scale = 0.5;          // image size at which visible pixels are counted
  double knee = 0;  // dB: of triangles and finest levels only those stay that bring so much for twice the samples; 0:
                    // all (train/topology/simplify.h)

  // Goals of simplifying (train/topology/simplify.h); 0: none. Qualities are means over the validation views.
  double target_psnr = 0, target_ssim = 0;
  std::uint64_t max_bytes = 0;  // of the model file
  std::uint32_t max_triangles = 0;
  std::uint32_t validation_views = 0;  // held out of the training views, spread evenly over them in name order; 0: none
  std::uint64_t round_steps = 0;       // steps after each removal
  std::uint32_t most_rounds = 24;

  double near = 0.025, far = 2.5;  // of training
  double test_near = 0.025;        // of test views

  std::uint64_t eval_every = 0;  // steps; 0: at the end only
  std::uint64_t checkpoint_every = 1000;
};

/// The published values of a recipe. What this project computes in another way is as it does it.
Settings published(Recipe recipe);
/// The same with every such difference that has a switch switched off (docs/method.md, "Where we differ").
Settings without_our_changes(Settings settings);

/// Above these, vertices are torn rather than moved (docs/decisions.md): those of real scenes,
/// and those of synthetic ones, which start from small triangles at random.
inline constexpr double kFastestVertices = 1e-2, kFastestSynthetic = 5e-3;
/// The vertex rate with which the rates of all steps add up to `way`, normalised units; at most `fastest`. VectorAdam
/// moves a vertex by about its rate in every step, however small the gradient is, so `way` is how far it can travel:
/// too little leaves triangles near where they started, too much tears them (docs/benchmarks.md, "Ablations").
double vertex_rate(const Settings& settings, double way, double fastest = kFastestVertices);
/// The way that a vertex has in a published training.
double published_way(Recipe recipe);

/// What rates are multiplied by in step 1..steps when they fall exponentially to `end`; in the rounds after it, of
/// round_steps steps each, they rise a bit and fall again.
double rate_factor(const Settings& settings, double end, std::uint64_t step);
/// The same of the vertices' rate, which comes to rest.
double vertex_rate_factor(const Settings& settings, std::uint64_t step);
/// Completed steps after which the levels change; 0: never.
std::uint64_t lift_step(const Settings& settings);
/// Completed steps after which steps look at the photographs at their own size (train/step/small_views.h); 0: all do.
std::uint64_t small_end(const Settings& settings);
/// The completed steps after which a run is evaluated when it is `per_decade` times in every ten-fold of steps: the
/// first after `step`, from step 10 on; 0: never.
std::uint64_t next_evaluation(std::uint32_t per_decade, std::uint64_t step);
/// The completed steps after which a training that ends before resample_every, and starts beyond its budget, has a
/// change of topology all the same; 0: none.
std::uint64_t only_resampling(const Settings& settings);
/// Whether triangles are resampled after this many completed steps; is_last_resampling: no later step is.
bool is_resampling(const Settings& settings, std::uint64_t step);
bool is_last_resampling(const Settings& settings, std::uint64_t step);
/// The completed steps after which the soup is next brought to its knee: the first after `step`; 0: none.
std::uint64_t next_pruning(const Settings& settings, std::uint64_t step);

/// The settings with which a training that has completed `step` steps goes on to `steps`, at least as many as it had:
/// its schedule is from then on that of `steps`. So rates, which end where they did, rise where it goes on, vertices
/// that rested move again, and topology changes up to its share of `steps`. Levels that have changed do not change
/// again.
Settings prolonged(Settings settings, std::uint64_t step, std::uint64_t steps);

/// "seed 0 (now 5), steps 100 (now 50)": what differs, by the names of to_json(); empty where nothing does.
std::string differences(const Settings& then, const Settings& now);

/// Throws Error on values that no run can have.
void check(const Settings& settings);

nlohmann::json to_json(const Settings& settings);
Settings settings_from_json(const nlohmann::json& json);  // throws Error

const char* to_string(Recipe recipe);

}  // namespace trisoup::train
