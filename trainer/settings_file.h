// The settings of a training from its record: what soup-train --settings takes.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "train/config/settings.h"

namespace trisoup {

struct SettingsFile {
  std::filesystem::path path;
  train::Settings settings;
  nlohmann::json
      dataset;  // how it was read: "resolution", "test_every", "background", "alpha"; null where the file does not say
};

/// A metrics.json, or what it has under "settings" alone. What an older one does not say is as it was before there was
/// a choice. Throws Error that names the file, and the nearest name where one is unknown.
SettingsFile read_settings_file(const std::filesystem::path& path);

}  // namespace trisoup
