// Command-line options for settings, from the table of settings (train/config/settings_table.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "train/config/settings_table.h"

namespace trisoup {

/// Adds options for settings to a command line and reads their values.
class SettingOptions {
 public:
  explicit SettingOptions(CLI::App& app) : app_(app) {}

  /// Adds an option for the setting, under the heading `group`.
  void add(const char* setting, const std::string& group);
  /// Adds options for all settings of a group of the table.
  void add_group(const char* table_group, const std::string& group);
  /// The values given on the command line. Throws Error if a value is invalid.
  std::vector<train::Assignment> given() const;

 private:
  struct Row {
    const train::Setting* setting;
    CLI::Option* option;
  };
  CLI::App& app_;
  std::vector<Row> rows_;
  std::map<std::string, std::string> texts_;  // values by name of the setting
};

/// Heading of the goal options.
inline constexpr const char* kGoalGroup =
    "Goal (the smallest model that meets it, by rounds of pruning and training at the end; exit status 3: missed)";

/// Rejects values such as "-1" and "1.5" for options that take a whole number.
void check_whole_numbers(CLI::App& app);

/// Help text of the settings for `--set`, by group, two lines each.
std::string experiments_text();
/// The table of settings in Markdown: docs/settings.md.
std::string settings_page();

}  // namespace trisoup
