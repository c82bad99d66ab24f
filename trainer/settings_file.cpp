#include "settings_file.h"

#include <algorithm>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "train/config/settings_table.h"

namespace trisoup {
namespace {

using nlohmann::json;

json parse(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  // Limits nesting: recursion through very deep lists would overflow the stack.
  constexpr int kDeepest = 16;
  const auto shallow = [&](int depth, json::parse_event_t, json&) {
    if (depth > kDeepest)
      throw Error("{}: nested deeper than a metrics.json; give the metrics.json of a training", path.string());
    return true;
  };
  try {
    return json::parse(text, shallow);
  } catch (const json::exception&) {
    throw Error("{}: not JSON; give the metrics.json of a training, or the object under its \"settings\"",
                path.string());
  }
}

}  // namespace

SettingsFile read_settings_file(const std::filesystem::path& path) {
  const json whole = parse(path);
  const bool is_metrics = whole.is_object() && whole.contains("settings");
  const json& given = is_metrics ? whole["settings"] : whole;
  if (!given.is_object() || !given.contains("recipe"))
    throw Error("{}: no settings of a training; give its metrics.json, or the object under its \"settings\"",
                path.string());
  for (const auto& [name, value] : given.items())
    if (!train::find_setting(name))
      throw Error("{}: unknown setting '{}'; the nearest is {}", path.string(), printable(name),
                  train::nearest_setting(name));
  SettingsFile file{path, {}, nullptr};
  try {
    file.settings = train::checked_settings_from_json(given);
  } catch (const std::exception& e) {
    throw Error("{}: {}", path.string(), e.what());
  }
  if (is_metrics && whole.contains("dataset")) file.dataset = whole["dataset"];
  return file;
}

}  // namespace trisoup
