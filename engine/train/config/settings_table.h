// The one table of settings. JSON, checks, presets, the programs' options, the library's setters and docs/settings.md
// all come from it: a new setting is a member of Settings and a row here.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "train/config/settings.h"

namespace trisoup::train {

/// What a number may be. Whole numbers are from `low` on, both ends included.
struct Range {
  double low = 0, high = std::numeric_limits<double>::infinity();
  bool without_low = false, without_high = false;

  bool has(double value) const {
    return (without_low ? value > low : value >= low) && (without_high ? value < high : value <= high);
  }
};

/// Default values. A preset without a value of its own has the usual one.
struct Defaults {
  std::optional<double> usual{};  // preset best; none: the scene decides, and `note` says how
  std::optional<double> fast{}, balanced{}, published{};
  std::optional<double> surface{};  // of a training that starts from a surface, but for published ones
  const char* note = "";
};

/// Where a setting can be changed, beside the library, which can change all of them.
enum class Access {
  option,      // an option of soup-train
  experiment,  // soup-train --set name=value
  internal     // follows from another setting
};

struct Setting {
  const char* group;
  const char* name;
  std::variant<bool Settings::*, std::uint32_t Settings::*, std::uint64_t Settings::*, double Settings::*,
               std::string Settings::*, std::array<double, 3> Settings::*, Recipe Settings::*>
      member;
  Access access;
  Range range;       // of numbers
  const char* help;  // noun first, then the unit; one line without a full stop
  Defaults defaults;
};

std::span<const Setting> settings_table();
/// Null if there is no setting of that name.
const Setting* find_setting(std::string_view name);
/// The name with the smallest edit distance to `name` (Levenshtein).
const char* nearest_setting(std::string_view name);

/// "true or false", "a number from 0 to 0.5", "a whole number from 1 on".
std::string allowed_values(const Setting& setting);
/// "10000; fast 1000, balanced 3000".
std::string default_values(const Setting& setting);

using SettingValue = std::variant<bool, std::uint64_t, double, std::string>;

struct Assignment {
  const Setting* setting = nullptr;
  SettingValue value;
};

/// Throws Error, which names the setting and its bounds, if `text` is not a value of it.
Assignment read_value(const Setting& setting, const std::string& text);
/// Reads "name=value". Throws Error with the nearest name if there is no such setting, and as read_value().
Assignment read_assignment(const std::string& text);
void assign(Settings& settings, const Assignment& assignment);

enum class Column { usual, fast, balanced, published, surface };
/// Sets all settings that have a default in that column of the table.
void set_defaults(Settings& settings, Column column);

}  // namespace trisoup::train
