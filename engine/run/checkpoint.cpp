#include "run/checkpoint.h"

#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/error.h"

namespace trisoup::train {
namespace {

/// Settings of an older checkpoint as they were before there was a choice.
void complete(nlohmann::json& settings) {
  const auto was = [&](const char* key, const nlohmann::json& value) {
    if (!settings.contains(key)) settings[key] = value;
  };
  was("small_share", 0.0);
  was("small_scale", 1.0);
  was("samples_per_pixel", 0.0);
  was("pixel_jitter", 0.0);
  was("init_opacity", 0.5);
  was("backdrop", 0.0);
  was("rest_share", 0.0);
  was("paint", false);
  was("rate_vertex_end", settings.value("rate_end", 0.01));
  was("fill_budget", false);
  was("huber", 0.0);
  was("texture_bits", 8u);
  was("exposure", false);
  const Settings now;
  was("target_psnr", now.target_psnr);
  was("target_ssim", now.target_ssim);
  was("knee", 0.0);
  was("max_bytes", now.max_bytes);
  was("max_triangles", now.max_triangles);
  was("validation_views", now.validation_views);
  was("round_steps", now.round_steps);
  was("most_rounds", now.most_rounds);
  was("least_views", settings.value("recipe", "") == "real" ? 0u : Settings().least_views);
}

}  // namespace

nlohmann::json with_todays_names(nlohmann::json settings) {
  if (const auto it = settings.find("coarse_scale"); it != settings.end()) {
    settings["small_scale"] = *it;
    settings.erase(it);
  }
  return settings;
}

std::string checkpoint_text(const soup::Safetensors& file, const std::filesystem::path& path, const char* key) {
  const auto it = file.metadata().find(key);
  if (it == file.metadata().end())
    throw Error("{}: lacks '{}'; it is not a checkpoint of this program, train anew with --overwrite", path.string(),
                key);
  return it->second;
}

std::uint64_t checkpoint_number(const soup::Safetensors& file, const std::filesystem::path& path, const char* key) {
  try {
    return std::stoull(checkpoint_text(file, path, key));
  } catch (const std::logic_error&) {
    throw Error("{}: '{}' is not a number; the checkpoint is damaged, train anew with --overwrite", path.string(), key);
  }
}

Settings settings_as_trained(nlohmann::json json) {
  json = with_todays_names(std::move(json));
  complete(json);
  const Settings settings = settings_from_json(json);
  check(settings);
  return settings;
}

CheckpointInfo checkpoint_info(const soup::Safetensors& file, const std::filesystem::path& path) {
  if (const std::string format = checkpoint_text(file, path, "format"); format != kCheckpointFormat)
    throw Error("{}: is of format '{}', this program reads '{}'; train anew with --overwrite", path.string(), format,
                kCheckpointFormat);
  CheckpointInfo info;
  try {
    info.settings = settings_as_trained(nlohmann::json::parse(checkpoint_text(file, path, "settings")));
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its settings are damaged; train anew with --overwrite", path.string());
  } catch (const Error& error) {
    throw Error("{}: its settings are damaged ({}); train anew with --overwrite", path.string(), error.what());
  }
  info.step = checkpoint_number(file, path, "step");
  if (file.metadata().contains("rounds")) info.rounds = checkpoint_number(file, path, "rounds");
  if (info.step > info.settings.steps + info.rounds * info.settings.round_steps)
    throw Error("{}: claims step {} of {}; the checkpoint is damaged, train anew with --overwrite", path.string(),
                info.step, info.settings.steps);
  if (const auto note = file.metadata().find("note"); note != file.metadata().end()) info.note = note->second;
  return info;
}

CheckpointInfo checkpoint_info(const std::filesystem::path& path) {
  return checkpoint_info(soup::Safetensors::open(path), path);
}

}  // namespace trisoup::train
