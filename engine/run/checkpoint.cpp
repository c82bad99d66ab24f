#include "run/checkpoint.h"

#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/error.h"

namespace trisoup::train {
std::string checkpoint_text(const soup::Safetensors& file, const std::filesystem::path& path, const char* key) {
  const auto it = file.metadata().find(key);
  if (it == file.metadata().end())
    throw Error("{}: not a checkpoint of this program ('{}' is missing); start again with `overwrite`", path.string(),
                key);
  return it->second;
}

std::uint64_t checkpoint_number(const soup::Safetensors& file, const std::filesystem::path& path, const char* key) {
  try {
    return std::stoull(checkpoint_text(file, path, key));
  } catch (const std::logic_error&) {
    throw Error("{}: damaged checkpoint ('{}' is not a number); start again with `overwrite`", path.string(), key);
  }
}

CheckpointInfo checkpoint_info(const soup::Safetensors& file, const std::filesystem::path& path) {
  if (const std::string format = checkpoint_text(file, path, "format"); format != kCheckpointFormat)
    throw Error("{}: written by another version (format '{}', expected '{}'); start again with `overwrite`",
                path.string(), format, kCheckpointFormat);
  CheckpointInfo info;
  try {
    info.settings = checked_settings_from_json(nlohmann::json::parse(checkpoint_text(file, path, "settings")));
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: damaged settings; start again with `overwrite`", path.string());
  } catch (const Error& error) {
    throw Error("{}: damaged settings ({}); start again with `overwrite`", path.string(), error.what());
  }
  info.step = checkpoint_number(file, path, "step");
  info.rounds = checkpoint_number(file, path, "rounds");
  if (info.step > info.settings.steps + info.rounds * info.settings.round_steps)
    throw Error("{}: damaged checkpoint (step {} of {}); start again with `overwrite`", path.string(), info.step,
                info.settings.steps);
  info.note = checkpoint_text(file, path, "note");
  return info;
}

CheckpointInfo checkpoint_info(const std::filesystem::path& path) {
  return checkpoint_info(soup::Safetensors::open(path), path);
}

}  // namespace trisoup::train
