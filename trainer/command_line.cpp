#include "command_line.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "run/presets.h"
#include "scene/hold_out.h"
#include "settings_file.h"
#include "train/topology/simplify.h"

namespace trisoup {

bool CommandLine::wants_points(const scene::Scene& scene) const {
  if (!record) return train::wants_points(choice(), scene);
  const std::string& from = init.empty() ? record->init : init;
  return from == "surface" || from == "points";
}

bool CommandLine::sets(const char* name) const {
  return std::any_of(experiments.begin(), experiments.end(),
                     [&](const train::Assignment& a) { return a.experiment->name == std::string_view(name); });
}

void CommandLine::apply(train::Settings& s, const scene::Scene& scene) const {
  const auto set = [](const auto& given, auto& value) {
    if (given) value = *given;
  };
  if (!recipe.empty()) s.recipe = recipe == "synthetic" ? train::Recipe::synthetic : train::Recipe::real;
  set(steps, s.steps);
  set(triangles, s.triangles);
  set(seed, s.seed);
  if (!init.empty()) s.init = init;
  set(init_count, s.init_count);
  const double unit = scene.normalisation.scale;
  if (init_box) {
    const glm::dvec3 origin = scene.normalisation.to_normalised(glm::dvec3(0.0));
    s.init_centre = {origin.x, origin.y, origin.z};
    s.init_box = *init_box * unit;
  }
  if (init_radius) s.init_radius = *init_radius * unit;
  set(level_max, s.level_max);
  set(texture_bits, s.texture_bits);
  set(exposure, s.exposure);
  set(knee, s.knee);
  set(target_psnr, s.target_psnr);
  set(target_ssim, s.target_ssim);
  if (max_megabytes) s.max_bytes = static_cast<std::uint64_t>(std::llround(*max_megabytes * 1048576.0));
  set(max_triangles, s.max_triangles);
  set(validation_views, s.validation_views);
  set(round_steps, s.round_steps);
  set(near, s.near);
  set(far, s.far);
  set(test_near, s.test_near);
  set(eval_every, s.eval_every);
  set(checkpoint_every, s.checkpoint_every);
  for (const train::Assignment& a : experiments) train::assign(s, a);
}

train::PresetChoice CommandLine::choice() const {
  std::optional<train::Recipe> which;
  if (!recipe.empty()) which = recipe == "synthetic" ? train::Recipe::synthetic : train::Recipe::real;
  return {preset, init, which, steps, triangles};
}

train::Settings CommandLine::settings(const scene::Scene& scene) const {
  train::Settings s;
  if (record) {
    s = *record;
    apply(s, scene);
  } else {
    s = train::of_preset(choice(), scene);
    apply(s, scene);
    if (sets("rate_end") && !sets("rate_vertex_end")) s.rate_vertex_end = s.rate_end;
    if (!sets("rate_vertex")) s.rate_vertex = train::preset_vertex_rate(choice(), s);
  }
  complete_goal(s, scene);
  train::check(s);
  return s;
}

void CommandLine::complete_goal(train::Settings& s, const scene::Scene& scene) const {
  if (!train::has_goal(s)) return;
  const bool quality = s.target_psnr > 0 || s.target_ssim > 0;
  // A quality may lie above the usual knee, and says itself where to end. What training gives up it gets over, removals
  // after it hardly.
  constexpr double kKneeBeforeGoal = 0.05;  // dB
  if (quality && !knee && !record && model.empty()) s.knee = std::min(s.knee, kKneeBeforeGoal);
  // Under a ceiling alone there is nothing to judge.
  if (quality && s.validation_views == 0 && !validation_views)
    s.validation_views = static_cast<std::uint32_t>(scene::usual_validation_views(scene));
  if (!round_steps && !(record && s.round_steps > 0)) s.round_steps = std::max<std::uint64_t>(20, s.steps / 20);
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
  throw Error("{}: was trained with {}; without these options it goes on as it began, or train anew with --overwrite",
              path.string(), differing);
}

}  // namespace

train::Settings CommandLine::resumed(const train::CheckpointInfo& checkpoint, const scene::Scene& scene,
                                     const std::filesystem::path& path) const {
  const train::Settings& then = checkpoint.settings;
  // Older checkpoints do not say which preset it was: then it is one where nothing that it brings is another.
  train::Settings now = record ? *record : !preset.empty() && noted_preset_.empty() ? settings(scene) : then;
  apply(now, scene);
  if (record) complete_goal(now, scene);
  if (!sets("most_triangles")) now.most_triangles = then.most_triangles;
  if (steps && *steps > then.steps && checkpoint.rounds > 0)
    throw Error("{}: has been simplified after its {} steps, and cannot go on to more; train anew with --overwrite",
                path.string(), then.steps);
  train::Settings goes_on = steps ? train::prolonged(then, checkpoint.step, *steps) : then;
  if (now.steps > then.steps && steps) {
    // What the shares of the first parts were told with is the first schedule.
    if (now.coarse_share == then.coarse_share) now.coarse_share = goes_on.coarse_share;
    if (now.small_share == then.small_share) now.small_share = goes_on.small_share;
    if (!round_steps) now.round_steps = goes_on.round_steps;
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

std::string CommandLine::preset_name() const { return !preset.empty() ? preset : record ? "as recorded" : "best"; }

namespace {

const char* name_of(scene::BackgroundChoice choice) {
  using enum scene::BackgroundChoice;
  return choice == white ? "white" : choice == black ? "black" : "auto";
}

scene::BackgroundChoice background_of(const std::string& name) {
  using enum scene::BackgroundChoice;
  return name == "white" ? white : name == "black" ? black : automatic;
}

const char* name_of(scene::AlphaUse use) { return use == scene::AlphaUse::mask ? "mask" : "composite"; }

}  // namespace

nlohmann::json CommandLine::dataset_note() const {
  return {{"resolution", load.downscale},
          {"test_every", load.test_every},
          {"background", name_of(load.background)},
          {"alpha", name_of(load.alpha)}};
}

std::string CommandLine::note() const {
  nlohmann::json json = dataset_note();
  json["preset"] = preset_name();
  json["feature_size"] = feature_size;
  json["eval_log"] = evaluations_per_decade;
  json["outside"] = load.outside;
  return json.dump();
}

void CommandLine::take_dataset(const nlohmann::json& then) {
  if (!given.resolution) load.downscale = then.value("resolution", load.downscale);
  if (!given.test_every) load.test_every = then.value("test_every", load.test_every);
  if (!given.background) load.background = background_of(then.value("background", "auto"));
  if (!given.alpha && then.value("alpha", "composite") == "mask") load.alpha = scene::AlphaUse::mask;
}

void CommandLine::take(const SettingsFile& file) {
  record = file.settings;
  if (!file.dataset.is_object()) return;
  try {
    take_dataset(file.dataset);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: what it says of the dataset is damaged; give its settings alone", file.path.string());
  }
}

void CommandLine::take(const std::string& note, const std::filesystem::path& path) {
  const nlohmann::json then = nlohmann::json::parse(note, nullptr, false), now = nlohmann::json::parse(this->note());
  if (!then.is_object()) return;  // of an older checkpoint, or another program's
  std::string differing;
  const auto is_another = [&](bool given, const char* key) {
    if (given && then.contains(key) && then[key] != now[key])
      differing +=
          fmt::format("{}{} {} (now {})", differing.empty() ? "" : ", ", key, then[key].dump(), now[key].dump());
  };
  is_another(!preset.empty(), "preset");
  is_another(given.resolution, "resolution");
  is_another(given.test_every, "test_every");
  is_another(given.background, "background");
  is_another(given.alpha, "alpha");
  is_another(given.feature_size, "feature_size");
  refuse(path, differing);
  try {
    preset = noted_preset_ = then.value("preset", "");
    take_dataset(then);
    feature_size = then.value("feature_size", feature_size);
    load.outside = load.outside || then.value("outside", false);
    if (!given.evaluations_per_decade) evaluations_per_decade = then.value("eval_log", evaluations_per_decade);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its note is damaged; train anew with --overwrite", path.string());
  }
}

}  // namespace trisoup
