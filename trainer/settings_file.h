// Reads the file of soup-train --settings: the recorded settings of another training.
#pragma once

#include <filesystem>

#include <nlohmann/json.hpp>

#include "train/config/settings.h"

namespace trisoup {

struct SettingsFile {
  std::filesystem::path path;
  train::Settings settings;
  /// Load options: "resolution", "test_every", "background", "alpha", "invert_masks" and so on. Null if the file does
  /// not contain them.
  nlohmann::json dataset;
};

/// Reads a metrics.json, or a file with only the object under its "settings". Settings that an older file lacks get the
/// values that applied before they existed. Throws Error if the file cannot be read, is not JSON, or has an unknown
/// setting or an invalid value.
SettingsFile read_settings_file(const std::filesystem::path& path);

}  // namespace trisoup
