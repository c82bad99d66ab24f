#include "command_line.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "run/presets.h"
#include "settings_file.h"
#include "train/config/schedule.h"

namespace trisoup {

bool CommandLine::wants_points(const scene::Scene& scene) const {
  if (!record) return train::wants_points(request, scene);
  train::Settings s = *record;
  train::apply(request, scene, s);
  return train::start_needs_points(s.init, scene);
}

train::Settings CommandLine::settings(const scene::Scene& scene) const {
  train::Settings s;
  if (record) {
    s = *record;
    train::apply(request, scene, s);
  } else {
    s = train::make_settings(request, scene);
  }
  train::complete_goal(request, scene, !record, s);
  train::check(s);
  return s;
}

train::Settings CommandLine::of_model(const nlohmann::json& trained, const scene::Scene& scene) const {
  train::Settings s;
  try {
    s = train::checked_settings_from_json(trained);
  } catch (const std::exception&) {
    throw Error("{}: its settings are not those of a training of this version, so training cannot continue", model);
  }
  // A goal of its own has been met or missed already.
  s.target_psnr = s.target_ssim = 0;
  s.max_bytes = s.max_triangles = 0;
  s.round_steps = 0;
  train::apply(request, scene, s);
  train::complete_goal(request, scene, false, s);
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
  train::Settings now = record ? *record : then;
  train::apply(request, scene, now);
  if (record) train::complete_goal(request, scene, false, now);
  if (!request.has("most_triangles")) now.most_triangles = then.most_triangles;
  const bool has_steps = request.has("steps");
  if (has_steps && now.steps > then.steps && checkpoint.rounds > 0)
    throw Error("{}: was simplified after its {} steps and cannot continue to more; train anew with --overwrite",
                path.string(), then.steps);
  train::Settings continued = has_steps ? train::extended(then, checkpoint.step, now.steps) : then;
  if (now.steps > then.steps && has_steps) {
    // Shares of the first parts were given for the first schedule.
    if (now.coarse_share == then.coarse_share) now.coarse_share = continued.coarse_share;
    if (now.small_share == then.small_share) now.small_share = continued.small_share;
    if (!request.has("round_steps")) now.round_steps = continued.round_steps;
  }
  // How often files are written may change; a record has it too, and only an option counts.
  if (!request.has("eval_every")) now.eval_every = then.eval_every;
  if (!request.has("checkpoint_every")) now.checkpoint_every = then.checkpoint_every;
  continued.eval_every = now.eval_every;
  continued.checkpoint_every = now.checkpoint_every;
  // Messages show lengths in the dataset's units, as they were given.
  train::Settings shown = continued;
  const double unit = scene.normalisation.scale;
  for (train::Settings* s : {&shown, &now}) s->init_box /= unit, s->init_radius /= unit;
  if (now.init_box != shown.init_box) now.init_centre = shown.init_centre;
  refuse(path, train::differences(shown, now));
  return continued;
}

void keep_from_overwrite(const CommandLine& o, const std::filesystem::path& file) {
  std::error_code ignored;
  if (o.overwrite && std::filesystem::equivalent(file.has_parent_path() ? file.parent_path() : ".", o.output, ignored))
    throw Error("{}: is in {}, which --overwrite would clear before a new model exists; choose another -o",
                printable(file.string()), printable(o.output));
}

std::string CommandLine::preset_name() const {
  return !request.preset.empty() ? request.preset : record ? "as recorded" : "best";
}

namespace {

constexpr std::pair<const char*, scene::DepthMaps> kDepthMaps[] = {{"auto", scene::DepthMaps::automatic},
                                                                   {"metric", scene::DepthMaps::metric},
                                                                   {"relative", scene::DepthMaps::relative},
                                                                   {"inverse", scene::DepthMaps::inverse},
                                                                   {"none", scene::DepthMaps::none}};

const char* name_of(scene::DepthMaps maps) {
  for (const auto& [name, value] : kDepthMaps)
    if (value == maps) return name;
  return "auto";
}

const char* name_of(scene::AlphaUse use) { return use == scene::AlphaUse::mask ? "mask" : "composite"; }

}  // namespace

scene::DepthMaps depth_maps_of(const std::string& name) {
  for (const auto& [known, value] : kDepthMaps)
    if (name == known) return value;
  return scene::DepthMaps::automatic;
}

nlohmann::json CommandLine::dataset_note() const {
  return {{"resolution", load.downscale},
          {"test_every", load.test_every},
          {"background", scene::name_of(load.background)},
          {"alpha", name_of(load.alpha)},
          {"invert_masks", load.invert_masks},
          {"depth_maps", name_of(load.depth_maps)},
          {"depth_unit", load.depth_unit}};
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
  if (!given.background) load.background = scene::background_named(then.value("background", "auto"));
  if (!given.alpha && then.value("alpha", "composite") == "mask") load.alpha = scene::AlphaUse::mask;
  if (!given.depth_maps) load.depth_maps = depth_maps_of(then.value("depth_maps", "none"));
  if (!given.depth_unit) load.depth_unit = then.value("depth_unit", 0.0);
  load.invert_masks = load.invert_masks || then.value("invert_masks", false);
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
  nlohmann::json then = nlohmann::json::parse(note, nullptr, false);
  const nlohmann::json now = nlohmann::json::parse(this->note());
  if (!then.is_object()) return;                                     // another program's
  if (!then.contains("invert_masks")) then["invert_masks"] = false;  // of an earlier version
  if (!then.contains("depth_maps")) then["depth_maps"] = "none", then["depth_unit"] = 0.0;
  std::string differing;
  const auto is_another = [&](bool given, const char* key) {
    if (given && then.contains(key) && then[key] != now[key])
      differing +=
          fmt::format("{}`{}` {} (now {})", differing.empty() ? "" : ", ", key, then[key].dump(), now[key].dump());
  };
  is_another(!request.preset.empty(), "preset");
  is_another(given.resolution, "resolution");
  is_another(given.test_every, "test_every");
  is_another(given.background, "background");
  is_another(given.alpha, "alpha");
  is_another(given.invert_masks, "invert_masks");
  is_another(given.depth_maps, "depth_maps");
  is_another(given.depth_unit, "depth_unit");
  is_another(given.feature_size, "feature_size");
  refuse(path, differing);
  try {
    request.preset = noted_preset_ = then.value("preset", "");
    take_dataset(then);
    feature_size = then.value("feature_size", feature_size);
    load.outside = load.outside || then.value("outside", false);
    if (!given.evaluations_per_decade) evaluations_per_decade = then.value("eval_log", evaluations_per_decade);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its note is damaged; train anew with --overwrite", path.string());
  }
}

}  // namespace trisoup
