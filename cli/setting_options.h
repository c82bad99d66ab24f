// Options of programs that the table of settings describes (train/config/settings_table.h).
#pragma once

#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "train/config/settings_table.h"

namespace trisoup {

/// Options that the table of settings describes.
class SettingOptions {
 public:
  explicit SettingOptions(CLI::App& app) : app_(app) {}

  /// Adds an option for the setting, under the heading `group`.
  void add(const char* setting, const std::string& group);
  /// Adds all options of a group of the table.
  void add_group(const char* table_group, const std::string& group);
  /// The values that were given. Throws Error on a value that the setting cannot have.
  std::vector<train::Assignment> given() const;

 private:
  struct Row {
    const train::Setting* setting;
    CLI::Option* option;
  };
  CLI::App& app_;
  std::vector<Row> rows_;
  std::map<std::string, std::string> texts_;  // by name of the setting
};

/// Heading of the options of goals.
inline constexpr const char* kGoalGroup =
    "Goal (the smallest model that meets it: after the last step, rounds of removing what matters least and training)";

/// Makes CLI11 refuse what is no whole number, "-1" and "1.5", where an option takes one.
void check_whole_numbers(CLI::App& app);

/// The settings of `--set` for people: two lines each, by group.
std::string experiments_text();
/// The whole table of settings in Markdown: docs/settings.md.
std::string settings_page();

}  // namespace trisoup
