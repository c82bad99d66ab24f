#include "cli/setting_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include <fmt/format.h>

#include "base/error.h"
#include "cli/option_names.h"

namespace trisoup {
namespace {

using train::Access;
using train::Setting;

constexpr double kMegabyte = 1e6;

/// Escapes |, which ends a cell in Markdown tables.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

/// Wraps lines between words, so that help fits a terminal of 120 columns.
std::string wrapped(const std::string& text, std::size_t columns) {
  std::string out;
  std::size_t line = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    const std::size_t length = end - at;
    if (line > 0) {
      const bool fits = line + 1 + length <= columns;
      out += fits ? ' ' : '\n';
      line = fits ? line + 1 : 0;
    }
    out += text.substr(at, length);
    line += length;
    at = end + 1;
  }
  return out;
}

/// Converts megabytes to bytes. 0 is no goal; other values must be between one byte and one terabyte. Throws Error.
std::uint64_t bytes_of_megabytes(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  if (!is_number || !(value == 0 || (value * kMegabyte >= 1.0 && value <= 1e6)))
    throw Error("`max_bytes`: '{}' is not a file size in megabytes; give a positive number, or 0 for no goal", text);
  return static_cast<std::uint64_t>(std::llround(value * kMegabyte));
}

const char* type_name(const Setting& setting) {
  if (setting.name == std::string_view("max_bytes")) return "FLOAT";
  return std::visit(
      []<typename T>(T train::Settings::*) {
        return std::is_same_v<T, double> ? "FLOAT" : std::is_integral_v<T> ? "UINT" : "TEXT";
      },
      setting.member);
}

}  // namespace

void SettingOptions::add(const char* name, const std::string& group) {
  const Setting* const setting = train::find_setting(name);
  const bool in_megabytes = name == std::string_view("max_bytes");
  const std::string defaults = train::default_values(*setting);
  const std::string help =
      wrapped(fmt::format("{} [{}]", in_megabytes ? "size of model.glb, megabytes" : setting->help, defaults), 90);
  const std::string option = option_of(name);
  const bool is_flag = std::holds_alternative<bool train::Settings::*>(setting->member);
  CLI::Option* const added =
      is_flag ? app_.add_flag(option, texts_[name], help) : app_.add_option(option, texts_[name], help);
  if (!is_flag) added->type_name(type_name(*setting));
  rows_.push_back({setting, added->group(group)});
}

void SettingOptions::add_group(const char* table_group, const std::string& group) {
  for (const Setting& setting : train::settings_table())
    if (setting.group == std::string_view(table_group) && setting.access == Access::option) add(setting.name, group);
}

std::vector<train::Assignment> SettingOptions::given() const {
  std::vector<train::Assignment> assignments;
  for (const Row& row : rows_) {
    if (row.option->count() == 0) continue;
    const std::string& text = texts_.at(row.setting->name);
    if (row.setting->name == std::string_view("max_bytes"))
      assignments.push_back({row.setting, bytes_of_megabytes(text)});
    else
      assignments.push_back(train::read_value(*row.setting, text));
  }
  return assignments;
}

void check_whole_numbers(CLI::App& app) {
  const CLI::Validator whole(
      [](const std::string& text) {
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc::result_out_of_range) return text + " is too large";
        return error != std::errc() || end != text.data() + text.size()
                   ? "'" + text + "' is not a whole number from 0 on"
                   : std::string();
      },
      "");
  for (CLI::Option* option : app.get_options())
    if (option->get_type_name() == "UINT") option->check(whole);
}

std::string experiments_text() {
  std::string text;
  std::string_view group;
  for (const Setting& s : train::settings_table()) {
    if (s.access != train::Access::experiment) continue;
    if (group != s.group) text += fmt::format("{}\n", s.group);
    group = s.group;
    text += fmt::format("  {:18} {}\n{:21}{} [{}]\n", s.name, s.help, "", allowed_values(s), default_values(s));
  }
  return text;
}

std::string settings_page() {
  std::string text =
      "# Settings\n\n"
      "All settings of a training. `metrics.json` records them under `settings`. In soup-train most settings have\n"
      "an option of the same name (`init_count`: `--init-count`). The library takes all of them as \"name=value\". "
      "The\n"
      "presets are `best` (the default), `fast`, `balanced` and `published`.\n\n"
      "`soup-train --settings-page` writes this page.\n";
  std::string_view group;
  for (const Setting& s : train::settings_table()) {
    if (s.access == train::Access::internal) continue;
    if (group != s.group)
      text += fmt::format("\n## {}\n\n| setting | meaning | default |\n| --- | --- | --- |\n", s.group);
    group = s.group;
    text += fmt::format("|`{}`{}|{}|{}|\n", s.name, s.access == train::Access::experiment ? "\\*" : "", cell(s.help),
                        default_values(s));
  }
  return text + "\n\\* experimental: `--set name=value`.\n";
}

}  // namespace trisoup
