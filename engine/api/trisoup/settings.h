// The settings of a training, as in docs/settings.md.
#pragma once

#include <string>
#include <vector>

namespace trisoup {

struct SettingInfo {
  std::string name;     // for TrainingOptions::set
  std::string group;    // of related settings
  std::string help;     // noun first, then the unit
  std::string values;   // allowed ones: "a number from 0 to 0.5"
  std::string initial;  // default values: "10000; fast 1000, balanced 3000"
};

/// All settings that can be changed.
std::vector<SettingInfo> settings();

}  // namespace trisoup
