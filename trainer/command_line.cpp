#include "command_line.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <deque>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "error.h"
#include "goal_options.h"
#include "scene/hold_out.h"
#include "train/simplify.h"
#include "train/start_points.h"

namespace trisoup {

std::optional<int> parse(int argc, char** argv, CommandLine& o) {
  CLI::App app{"Turns photographs into a few thousand opaque textured triangles.\n\n"
               "DATASET is a folder (or transforms .json) of Blender/NeRF-Synthetic, instant-ngp, nerfstudio or COLMAP;\n"
               "or a folder of photographs without poses, or a video: COLMAP finds the poses and leaves them in OUT/colmap.\n"
               "OUT receives model.glb, checkpoint.safetensors, train.csv, evaluations.csv, metrics.json and renders/."};
  app.option_defaults()->take_last();  // of an option given twice the last counts, so that scripts can override
  // One line, like every other error of this program.
  app.failure_message([](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-train: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-train " TRISOUP_VERSION);
  app.add_option("DATASET", o.dataset, "folder of photographs, or a video");
  app.add_option("-o,--output", o.output, "folder for what the run leaves");

  auto* common = app.add_option_group("Common");
  common->add_option("--preset", o.preset, "fast (1,000 steps, 2,000 triangles, textures to level 4), balanced (3,000, 5,000, 4), best (10,000, 15,000, 5),\n"
                     "or published (all as in the publication where there is an option for it; fewer steps move vertices as far as 10,000) [best]")
      ->check(CLI::IsMember({"fast", "balanced", "best", "published"}));
  common->add_option("--steps", o.steps, "training steps; schedules scale with them [10000]");
  common->add_option("--triangles", o.triangles, "budget of triangles [15000]");
  common->add_option("--seed", o.seed, "same seed, same device: the same model bit for bit [0]");
  auto* resume = common->add_flag("--resume", o.resume, "go on from OUT/checkpoint.safetensors, if there is one, with all its settings; options that say otherwise are\n"
                     "refused, but for more --steps: the schedule is then that of so many, so rates rise again and topology changes up to its share of them");
  common->add_flag("--overwrite", o.overwrite, "train anew where OUT holds a training: what that one left goes when the first step begins")->excludes(resume);

  auto* goal = add_goal_options(app, o);

  auto* data = app.add_option_group("Dataset");
  auto* resolution = data->add_option("-r,--resolution", o.load.downscale, "divide image sides by this factor [1]");
  auto* test_every = data->add_option("--test-every", o.load.test_every, "hold out every K-th view in name order where there is no test split; 0: none [8]");
  data->add_flag("--outside", o.load.outside, "photographs, masks and points may lie outside of DATASET, where its files say so");
  auto* feature_size = data->add_option("--feature-size", o.feature_size, "photographs without poses: features are looked for in copies of so many pixels along the longer side [1600]")
      ->check(CLI::Range(100, 100'000));
  std::string background = "auto", alpha = "composite";
  auto* background_option = data->add_option("--background", background, "auto (white where images have alpha, else black), white or black [auto]")
      ->check(CLI::IsMember({"auto", "white", "black"}));
  auto* alpha_option = data->add_option("--alpha", alpha, "composite: on the background; mask: of the loss [composite]")->check(CLI::IsMember({"composite", "mask"}));

  auto* start = app.add_option_group("Start");
  start->add_option("--init", o.init, "surface (that the dataset's points tell, or points found in the photographs), points, random, or a mesh\n"
                    "file (.obj .ply .gltf .glb) [real scenes surface, synthetic ones random; published: points if there are any]");
  start->add_option("--init-count", o.init_count, "triangles at the start [surface --triangles; random 30000, points 15000; fast and balanced 10000, but 30000 random ones\n"
                     "in real scenes; published 100000 random ones in synthetic scenes]");
  start->add_option("--init-box", o.init_box, "random: half the side of a box around the dataset's origin, in its units");
  start->add_option("--init-opacity", o.init_opacity, "opacity at the start [surface 0.9, else 0.5]");
  start->add_option("--backdrop", o.backdrop, "radius of a sphere of 80 triangles around the scene that always stays, normalised units; 0: none\n"
                    "[surface: three times as far as the farthest point]");
  start->add_option("--init-radius", o.init_radius, "random: circumradius of the triangles, in the dataset's units");

  auto* method = app.add_option_group("Method");
  const CLI::Validator yes_or_no(
      [](const std::string& text) {
        for (const char* each : {"true", "false", "1", "0", "on", "off", "yes", "no"})
          if (text == each) return std::string();
        return "'" + text + "' is neither true nor false";
      },
      "");
  // Presets differ in them, so that not given is not the same as off.
  struct Choice {
    bool value = false, inverted = false;
    CLI::Option* option = nullptr;
    std::optional<bool>* to = nullptr;
  };
  std::deque<Choice> choices;
  const auto flag = [&](const char* name, std::optional<bool>& to, const char* help, bool inverted = false) {
    Choice& choice = choices.emplace_back();
    choice.option = method->add_flag(name, choice.value, help);
    choice.option->check(yes_or_no);
    choice.to = &to, choice.inverted = inverted;
  };
  method->add_option("--recipe", o.recipe, "how triangles are dropped and split [by dataset format]")
      ->check(CLI::IsMember({"synthetic", "real"}));
  method->add_option("--batch", o.batch, "views per step [4]");
  method->add_option("--rate-texture", o.rate_texture, "learning rate of textures [0.05; from a surface 0.1]");
  method->add_option("--rate-mlp", o.rate_mlp, "learning rate of the MLP [0.01]");
  method->add_option("--rate-vertex", o.rate_vertex, "learning rate of vertices, normalised units [what lets vertices travel far\n"
                     "enough, at most 0.005, real 0.01; published: synthetic 0.00025, real 0.0025, or as far as with these in 10,000 steps]");
  method->add_option("--rate-end", o.rate_end, "all rates fall exponentially to this share [0.1; published 0.01]");
  method->add_option("--rate-vertex-end", o.rate_vertex_end, "that of vertices to this one [as --rate-end; without it from a surface 0.03]");
  method->add_option("--rest-share", o.rest_share, "share of the steps, the last ones, in which vertices come to rest [0; from a surface 0.2]");
  method->add_option("--huber", o.huber, "errors of colours below it pull in proportion to their size; 0: all alike, as published [0.1]");
  auto* levels = method->add_option("--levels", o.levels,
                     "coarse-to-fine, all (the fine levels from the first step on) or finest (--level-max alone, from the first step on)\n"
                     "[coarse-to-fine; from a surface all]")
      ->check(CLI::IsMember({"coarse-to-fine", "all", "finest"}));
  method->add_option("--coarse-level", o.coarse_level, "texture level of the first part [0]");
  auto* coarse_share = method->add_option("--coarse-share", o.coarse_share, "share of the steps in the first part [0.5; from a surface 0]");
  flag("--paint", o.paint, "a start from a surface has the photographs' colours in its fine levels, where there is no coarse part [on]");
  levels->excludes(coarse_share);
  method->add_option("--level-min", o.level_min, "coarsest texture level after it [2]");
  method->add_option("--level-max", o.level_max, "finest texture level [5]");
  method->add_option("--samples-per-pixel", o.samples_per_pixel,
                     "a triangle's finest level has so many samples for every pixel of the photograph that shows it largest, between\n"
                     "--level-min and --level-max; 0: --level-max for all, as published [1]");
  method->add_option("--pixel-jitter", o.pixel_jitter,
                     "a step looks at each picture beside the centres of its pixels, at most so many pixels off along each axis: long trainings would\n"
                     "learn by heart what holds at the centres alone; 0 to 0.5; 0: at the centres, as published [0.25]");
  flag("--exposure", o.exposure,
       "photographs differ in exposure and white balance: each has gains and offsets of its own, fitted as training goes; the model\n"
       "has the mean of all [on in real scenes, off in synthetic ones and in published]");
  method->add_flag("--opaque", o.opaque, "opacity fixed to 1: no masking in training, and every triangle opaque in the model");
  method->add_flag("--keep-opacity", o.keep_opacity, "do not restart opacity when the levels change");
  flag("--no-opacity-baseline", o.opacity_baseline,
       "opacities learn from a pixel's error alone, as published, not from how it differs from its neighbours'", true);
  flag("--update-unseen", o.update_unseen,
       "textures of triangles that no view of a step has shown go on by their moments, as published");
  flag("--copy-textures", o.copy_textures, "halves of a split triangle copy its texture, as published");
  flag("--drop-near", o.drop_near, "drop triangles that reach the camera plane whole, as published, instead of clipping them");
  method->add_flag("--keep-moments", o.keep_moments, "textures keep their optimiser state through resampling");
  method->add_option("--resample-every", o.resample_every, "steps between topology changes [1 % of the steps, at least 100]");
  method->add_option("--resample-until", o.resample_until, "share of the steps after which topology stays [0.95; from a surface 0.5]");
  method->add_option("--split-views", o.split_views, "real: views in which edges are measured [20]");
  method->add_option("--split-length", o.split_length, "real: longest edge as a share of the image height [0.2]");
  flag("--fill-budget", o.fill_budget,
       "real: the triangles that photographs show largest are split until there are --triangles [off; from a surface on]");
  method->add_option("--least-views", o.least_views,
                     "real: triangles that fewer training views show are dropped, as they stand before the cameras, not where anything is; at most a\n"
                     "tenth of the views; 0: as published [4]");
  method->add_option("--most-triangles", o.most_triangles,
                     "real: how far splitting goes beyond --triangles between two resamplings [what memory allows, up to 8 times; from a\n"
                     "surface not at all]");
  method->add_option("--near", o.near, "near plane of training, normalised units [synthetic 0.025, real 0.0025; from a surface before all that was seen]");
  method->add_option("--far", o.far, "far plane [synthetic 2.5, real 100, or beyond the farthest point]");
  method->add_option("--test-near", o.test_near, "near plane of test views [synthetic 0.025, real 0.125; from a surface that of training]");

  auto* output = app.add_option_group("Output");
  output->add_option("--texture-bits", o.texture_bits, "how finely the model tells its textures: fewer pack into fewer bytes; 8 is exact [6; published 8]");
  output->add_option("--eval-every", o.eval_every, "steps between evaluations of the test views [0: at the end only]");
  auto* eval_log = output->add_option("--eval-log", o.evaluations_per_decade, "evaluations in every ten-fold of steps, from step 10 on [0: none]")
      ->check(CLI::Range(0, 100));
  output->add_option("--checkpoint-every", o.checkpoint_every, "steps between checkpoints [1000]");
  output->add_option("--log-every", o.log_every, "steps between lines where output is not a terminal [1 % of the steps]");
  output->add_flag("-q,--quiet", o.quiet, "errors only");
  auto* view = output->add_flag("--view", o.view, "show the soup in a window while it is trained");
  output->add_flag("--finish-headless", o.finish_headless, "closing the window of --view lets training go on; else it ends, with a checkpoint")
      ->needs(view);
  output->add_flag("--timings", o.timings, "time of every kernel, at the end and in metrics.json");

  auto* device = app.add_option_group("Device");
  device->add_flag("--list-devices", o.list_devices, "print the devices and end");
  device->add_option("--backend", o.device.backend, "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else the CPU's own threads]");
  device->add_option("--device", o.device.device, "number that --list-devices prints, or part of a name of any backend [the fastest kind there is]");
  device->add_option("--memory", o.memory_mb, "ceiling of device memory in MB [nine tenths of what is free]");
  device->add_flag("--by-itself", o.by_itself, "train alone although mpirun or srun has started several processes; else those train one soup together");
  device->add_option("--lose-after-launches", o.device.lose_after_launches)->group("");  // for tests: not in --help
  device->add_flag("--validation", o.device.validation, "with the Vulkan validation layers; any message is an error");

  for (auto* group : {common, goal, data, start, method, output, device}) check_whole_numbers(*group);

  try {
    app.parse(argc, argv);
    for (const Choice& choice : choices)
      if (choice.option->count() > 0) *choice.to = choice.value != choice.inverted;
    const auto is_given = [](const CLI::Option* option) { return option->count() > 0; };
    o.given = {is_given(resolution), is_given(test_every), is_given(background_option), is_given(alpha_option), is_given(feature_size), is_given(eval_log)};
    using enum scene::BackgroundChoice;
    o.load.background = background == "white" ? white : background == "black" ? black : automatic;
    o.load.alpha = alpha == "mask" ? scene::AlphaUse::mask : scene::AlphaUse::composite;
    if (o.list_devices) return std::nullopt;
    if (o.dataset.empty()) throw CLI::RequiredError("DATASET");
    if (o.output.empty()) throw CLI::RequiredError("-o");
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  }
  return std::nullopt;
}

namespace {

/// What a start that covers the scene in its colours asks for: docs/method.md, "Start".
void start_from_surface(train::Settings& s, const scene::Scene& scene, bool as_published) {
  s.init_count = s.triangles;
  const train::Reach reach = train::reach_of(scene);
  s.far = std::max(s.far, 3.3 * reach.farthest);
  if (as_published) return;
  s.backdrop = 3.0 * reach.farthest;
  s.near = s.test_near = reach.nearest;
  s.init_opacity = 0.9;
  s.coarse_share = 0;
  s.paint = true;
  s.keep_opacity = true;
  s.rate_texture = 0.1;
  // Where vertices have found their place, going on opens cracks.
  s.rate_vertex_end = 0.03;
  s.rest_share = 0.2;
  // Splits take the room of what no view shows, and no more: what they make beyond the budget has to go again, and leaves its place open.
  s.most_triangles = s.triangles;
  s.fill_budget = true;
  s.resample_until = 0.5;
}

}  // namespace

bool CommandLine::wants_points(const scene::Scene& scene) const {
  if (!init.empty()) return init == "surface" || init == "points";
  return preset != "published" && !scene.synthetic;
}

void CommandLine::apply(train::Settings& s, const scene::Scene& scene) const {
  const auto set = [](const auto& given, auto& value) {
    if (given) value = *given;
  };
  set(steps, s.steps);
  set(triangles, s.triangles);
  set(batch, s.batch);
  set(seed, s.seed);
  if (!init.empty()) s.init = init;
  set(init_count, s.init_count);
  set(init_opacity, s.init_opacity);
  set(backdrop, s.backdrop);
  const double unit = scene.normalisation.scale;
  if (init_box) {
    const glm::dvec3 origin = scene.normalisation.to_normalised(glm::dvec3(0.0));
    s.init_centre = {origin.x, origin.y, origin.z};
    s.init_box = *init_box * unit;
  }
  if (init_radius) s.init_radius = *init_radius * unit;
  set(rate_texture, s.rate_texture);
  set(rate_mlp, s.rate_mlp);
  set(rate_vertex, s.rate_vertex);
  set(rate_end, s.rate_end);
  set(rate_vertex_end, s.rate_vertex_end);
  set(rest_share, s.rest_share);
  set(paint, s.paint);
  set(huber, s.huber);
  set(coarse_level, s.coarse_level);
  set(coarse_share, s.coarse_share);
  set(level_min, s.level_min);
  set(level_max, s.level_max);
  set(samples_per_pixel, s.samples_per_pixel);
  set(texture_bits, s.texture_bits);
  set(pixel_jitter, s.pixel_jitter);
  if (levels == "all" || levels == "finest") s.coarse_share = 0;
  // Asked for where it is not usual: from a surface, whose shapes need little of it.
  if (levels == "coarse-to-fine" && s.coarse_share == 0) s.coarse_share = 0.05;
  if (levels == "finest") s.level_min = s.level_max;
  s.opaque = s.opaque || opaque;
  s.keep_opacity = s.keep_opacity || keep_opacity;
  s.keep_moments = s.keep_moments || keep_moments;
  set(copy_textures, s.copy_textures);
  set(drop_near, s.drop_near);
  set(opacity_baseline, s.opacity_baseline);
  set(update_unseen, s.update_unseen);
  set(exposure, s.exposure);
  set(fill_budget, s.fill_budget);
  set(resample_every, s.resample_every);
  set(resample_until, s.resample_until);
  set(split_views, s.split_views);
  set(split_length, s.split_length);
  set(least_views, s.least_views);
  set(most_triangles, s.most_triangles);
  set(target_psnr, s.target_psnr);
  set(target_ssim, s.target_ssim);
  if (max_megabytes) s.max_bytes = static_cast<std::uint64_t>(std::llround(std::max(0.0, *max_megabytes) * 1048576.0));
  set(max_triangles, s.max_triangles);
  set(validation_views, s.validation_views);
  set(round_steps, s.round_steps);
  set(near, s.near);
  set(far, s.far);
  set(test_near, s.test_near);
  set(eval_every, s.eval_every);
  set(checkpoint_every, s.checkpoint_every);
}

train::Settings CommandLine::settings(const scene::Scene& scene) const {
  using train::Recipe;
  const Recipe which = recipe.empty() ? (scene.synthetic ? Recipe::synthetic : Recipe::real)
                                      : (recipe == "synthetic" ? Recipe::synthetic : Recipe::real);
  train::Settings s = train::published(which);
  double way = 0;  // of a vertex
  if (preset == "published") s = train::without_our_changes(s);
  else {
    // Points of the Pareto front in docs/charts.md. All of its trainings share these rates.
    s.rate_end = s.rate_vertex_end = 0.1;
    s.huber = 0.1;
    s.texture_bits = 6;
    way = which == Recipe::synthetic ? 1.5 : 4.0;
    // Pictures that were rendered have one exposure.
    s.exposure = which == Recipe::real;
    if (which == Recipe::synthetic) s.init_count = 30'000;
  }
  if (preset == "fast") s.steps = 1000, s.triangles = 2000, s.init_count = 10'000, s.level_max = 4;
  if (preset == "balanced") s.steps = 3000, s.triangles = 5000, s.init_count = 10'000, s.level_max = 4;

  if (steps) s.steps = *steps;
  s.resample_every = std::max<std::uint64_t>(100, s.steps / 100);
  if (triangles) s.triangles = *triangles;

  const bool has_points = !scene.points.positions.empty();
  s.init = !init.empty() ? init : !has_points ? "random" : preset == "published" ? "points" : "surface";
  if (s.init == "surface") start_from_surface(s, scene, preset == "published");
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
  if (rate_end) s.rate_vertex_end = *rate_end;
  apply(s, scene);
  if (!rate_vertex && way > 0)
    s.rate_vertex = train::vertex_rate(s, way, which == Recipe::synthetic ? train::kFastestSynthetic : train::kFastestVertices);
  else if (!rate_vertex) s.rate_vertex = std::max(s.rate_vertex, train::vertex_rate(s, train::published_way(which)));
  complete_goal(s, scene);
  train::check(s);
  return s;
}

void CommandLine::complete_goal(train::Settings& s, const scene::Scene& scene) const {
  if (!train::has_goal(s)) return;
  if (s.validation_views == 0 && !validation_views) s.validation_views = static_cast<std::uint32_t>(scene::usual_validation_views(scene));
  if (!round_steps) s.round_steps = std::max<std::uint64_t>(20, s.steps / 20);
}

train::Settings CommandLine::of_model(const nlohmann::json& trained, const scene::Scene& scene) const {
  train::Settings s;
  try {
    s = train::settings_as_trained(trained);
  } catch (const std::exception&) {
    throw Error("{}: its settings are not those of soup-train, so it cannot be trained on", model);
  }
  // Its own goal, if it had one, has been met or missed.
  s.target_psnr = s.target_ssim = 0;
  s.max_bytes = s.max_triangles = 0;
  apply(s, scene);
  complete_goal(s, scene);
  train::check(s);
  return s;
}

namespace {

/// Says in one line what contradicts a checkpoint, if anything does.
void refuse(const std::filesystem::path& path, const std::string& differing) {
  if (differing.empty()) return;
  throw Error("{}: was trained with {}; without these options it goes on as it began, or train anew with --overwrite", path.string(), differing);
}

}  // namespace

train::Settings CommandLine::resumed(const train::CheckpointInfo& checkpoint, const scene::Scene& scene, const std::filesystem::path& path) const {
  const train::Settings& then = checkpoint.settings;
  // Older checkpoints do not say which preset it was: then it is one where nothing that it brings is another.
  train::Settings now = !preset.empty() && noted_preset_.empty() ? settings(scene) : then;
  apply(now, scene);
  if (!recipe.empty()) now.recipe = recipe == "synthetic" ? train::Recipe::synthetic : train::Recipe::real;
  if (!most_triangles) now.most_triangles = then.most_triangles;
  if (steps && *steps > then.steps && checkpoint.step > then.steps)
    throw Error("{}: has been simplified after its {} steps, and cannot go on to more; train anew with --overwrite", path.string(), then.steps);
  train::Settings goes_on = steps ? train::prolonged(then, checkpoint.step, *steps) : then;
  if (now.steps > then.steps && steps) {
    // What the share of the coarse part was told with is the first schedule.
    if (now.coarse_share == then.coarse_share) now.coarse_share = goes_on.coarse_share;
  }
  goes_on.eval_every = eval_every.value_or(then.eval_every);
  goes_on.checkpoint_every = checkpoint_every.value_or(then.checkpoint_every);
  now.eval_every = goes_on.eval_every, now.checkpoint_every = goes_on.checkpoint_every;
  train::Settings shown = goes_on;
  // Lengths that are given in the dataset's units are told in them.
  const double unit = scene.normalisation.scale;
  for (train::Settings* s : {&shown, &now}) s->init_box /= unit, s->init_radius /= unit;
  if (now.init_box != shown.init_box) now.init_centre = shown.init_centre;
  refuse(path, train::differences(shown, now));
  return goes_on;
}

std::string CommandLine::note() const {
  using enum scene::BackgroundChoice;
  return nlohmann::json{{"preset", preset_name()},
                        {"resolution", load.downscale},
                        {"test_every", load.test_every},
                        {"background", load.background == white ? "white" : load.background == black ? "black" : "auto"},
                        {"alpha", load.alpha == scene::AlphaUse::mask ? "mask" : "composite"},
                        {"feature_size", feature_size},
                        {"eval_log", evaluations_per_decade}}
      .dump();
}

void CommandLine::take(const std::string& note, const std::filesystem::path& path) {
  const nlohmann::json then = nlohmann::json::parse(note, nullptr, false), now = nlohmann::json::parse(this->note());
  if (!then.is_object()) return;  // of an older checkpoint, or another program's
  std::string differing;
  const auto is_another = [&](bool given, const char* key) {
    if (given && then.contains(key) && then[key] != now[key])
      differing += fmt::format("{}{} {} (now {})", differing.empty() ? "" : ", ", key, then[key].dump(), now[key].dump());
  };
  is_another(!preset.empty(), "preset");
  is_another(given.resolution, "resolution");
  is_another(given.test_every, "test_every");
  is_another(given.background, "background");
  is_another(given.alpha, "alpha");
  is_another(given.feature_size, "feature_size");
  refuse(path, differing);
  try {
    using enum scene::BackgroundChoice;
    preset = noted_preset_ = then.value("preset", "");
    load.downscale = then.value("resolution", load.downscale);
    load.test_every = then.value("test_every", load.test_every);
    if (!given.background) {
      const std::string background = then.value("background", "auto");
      load.background = background == "white" ? white : background == "black" ? black : automatic;
    }
    if (!given.alpha && then.value("alpha", "composite") == "mask") load.alpha = scene::AlphaUse::mask;
    feature_size = then.value("feature_size", feature_size);
    if (!given.evaluations_per_decade) evaluations_per_decade = then.value("eval_log", evaluations_per_decade);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its note is damaged; train anew with --overwrite", path.string());
  }
}

}  // namespace trisoup
