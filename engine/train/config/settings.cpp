#include "train/config/settings.h"

#include <cmath>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "train/config/settings_table.h"

namespace trisoup::train {
namespace {

Recipe recipe_of(const std::string& name) { return name == "synthetic" ? Recipe::synthetic : Recipe::real; }

/// Kernels compute in float: what that cannot hold would only show as a training that diverges.
void check_is_float(const Setting& setting, double value) {
  if (!(std::abs(value) < 1e37) || (value != 0 && std::abs(value) < 1e-37))
    throw Error("`{}` is {}; it must be a number that a float can hold", setting.name, value);
}

void check_range(const Setting& setting, const Settings& settings) {
  std::visit(
      [&]<typename T>(T Settings::*member) {
        if constexpr (std::is_same_v<T, double>) check_is_float(setting, settings.*member);
        if constexpr (std::is_same_v<T, std::array<double, 3>>)
          for (const double value : settings.*member) check_is_float(setting, value);
        if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>)
          if (!setting.range.has(static_cast<double>(settings.*member)))
            throw Error("`{}` is {}; it must be {}", setting.name, settings.*member, allowed_values(setting));
      },
      setting.member);
}

template <typename T>
void read_member(const nlohmann::json& given, const char* name, T& value) {
  // nlohmann converts -1 and 2.5 to whole numbers silently.
  if constexpr (std::is_unsigned_v<T> && !std::is_same_v<T, bool>)
    if (!given.is_number_unsigned() || given.get<std::uint64_t>() > std::numeric_limits<T>::max())
      throw Error("`{}` is {}; it must be a whole number from 0 to {}", name, printable(given.dump()),
                  std::numeric_limits<T>::max());
  given.get_to(value);
}

}  // namespace

const char* to_string(Recipe recipe) { return recipe == Recipe::synthetic ? "synthetic" : "real"; }

bool starts_from_surface(const Settings& s) { return s.init == "surface" && !s.published; }

bool surface_decides_budget(const Settings& settings) { return settings.init == "surface" && settings.least_shift > 0; }

void set_budget(Settings& settings, std::uint32_t triangles) {
  if (settings.init == "surface") {
    if (settings.init_count == settings.triangles) settings.init_count = triangles;
    if (settings.most_triangles == settings.triangles) settings.most_triangles = triangles;
  }
  settings.triangles = triangles;
}

void check(const Settings& s) {
  for (const Setting& setting : settings_table()) check_range(setting, s);
  const auto need = [](bool ok, const char* what) {
    if (!ok) throw Error("{}", what);
  };
  const bool has_quality = s.target_psnr > 0 || s.target_ssim > 0;
  const bool starts_from_file = s.init != "surface" && s.init != "points" && s.init != "random";
  need(s.removed_from.empty() || starts_from_file,
       "`removed_from` needs the model that remains as `init`; give its path");
  need(s.level_min <= s.level_max, "`level_min` is above `level_max`; give them in order");
  need(s.far > s.near, "`near` is not in front of `far`; 0 < `near` < `far` must hold");
  need(s.far > s.test_near, "`test_near` is not in front of `far`; 0 < `test_near` < `far` must hold");
  need(s.backdrop < s.far, "`backdrop` is not in front of `far`; lower it");
  need(s.most_triangles == 0 || s.most_triangles >= s.triangles,
       "`most_triangles` is below `triangles`; use at least the budget");
  need(s.round_steps > 0 || (!has_quality && s.max_bytes == 0 && s.max_triangles == 0),
       "`round_steps` 0 leaves no step after a removal; use 1 or more");
  need(s.validation_views > 0 || !has_quality,
       "`validation_views` 0 leaves no view to measure a quality with; use 1 or more");
}

std::string differences(const Settings& before, const Settings& now) {
  const nlohmann::json then = to_json(before), today = to_json(now);
  std::string text;
  for (const auto& [key, value] : today.items())
    if (then.at(key) != value)
      text += fmt::format("{}`{}` {} (now {})", text.empty() ? "" : ", ", key, then.at(key).dump(), value.dump());
  return text;
}

nlohmann::json to_json(const Settings& settings) {
  nlohmann::json json;
  for (const Setting& setting : settings_table())
    std::visit(
        [&]<typename T>(T Settings::*member) {
          if constexpr (std::is_same_v<T, std::string>)
            json[setting.name] = utf8(settings.*member);
          else if constexpr (std::is_same_v<T, Recipe>)
            json[setting.name] = to_string(settings.*member);
          else
            json[setting.name] = settings.*member;
        },
        setting.member);
  return json;
}

Settings settings_from_json(const nlohmann::json& json) {
  Settings settings;
  try {
    for (const Setting& setting : settings_table())
      std::visit(
          [&]<typename T>(T Settings::*member) {
            if constexpr (std::is_same_v<T, std::string>)
              if (member == &Settings::removed_from && !json.contains(setting.name)) return;  // of an earlier version
            const nlohmann::json& given = json.at(setting.name);
            if constexpr (std::is_same_v<T, Recipe>)
              settings.*member = recipe_of(given.get<std::string>());
            else
              read_member(given, setting.name, settings.*member);
          },
          setting.member);
  } catch (const nlohmann::json::exception& e) {
    throw Error("settings: {}", e.what());
  }
  return settings;
}

Settings checked_settings_from_json(const nlohmann::json& json) {
  const Settings settings = settings_from_json(json);
  check(settings);
  return settings;
}

}  // namespace trisoup::train
