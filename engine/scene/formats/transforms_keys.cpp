#include "scene/formats/transforms_keys.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "scene/text/json_numbers.h"

namespace trisoup::scene {

using nlohmann::json;

bool is_not_finite(const json& value) {
  return value.is_string() && value.get_ref<const std::string&>().starts_with(kNotFinite);
}

double to_number(const json& value, const std::string& where) {
  if (is_not_finite(value)) throw Error("{} is not finite; correct it", where);
  if (!value.is_number()) throw Error("{} is {}, not a number; correct it", where, value.type_name());
  const double number = value.get<double>();
  if (!std::isfinite(number)) throw Error("{} is not finite; correct it", where);
  return number;
}

const std::string& to_text(const json& value, const std::string& where) {
  if (is_not_finite(value)) throw Error("{} is a number, not a string; correct it", where);
  if (!value.is_string()) throw Error("{} is {}, not a string; correct it", where, value.type_name());
  const auto& text = value.get_ref<const std::string&>();
  if (text.find('\0') != std::string::npos) throw Error("{} contains a zero character; correct it", where);
  return text;
}

bool to_flag(const json& value, const std::string& where) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number() && (value == 0 || value == 1)) return value == 1;
  if (value.is_string()) {
    std::string text = value.get<std::string>();
    std::transform(text.begin(), text.end(), text.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
    if (text == "true" || text == "1") return true;
    if (text == "false" || text == "0") return false;
  }
  throw Error("{} is {}, not true or false; correct it", where, value.type_name());
}

FrameKeys::FrameKeys(const json& root, const json& frame, std::string file, std::string place)
    : root_(root), frame_(frame), file_(std::move(file)), place_(std::move(place)) {}

const json* FrameKeys::find(Level level, std::string_view key) const {
  const json& holder = level == Level::frame ? frame_ : root_;
  const auto found = holder.find(key);
  return found != holder.end() && !found->is_null() ? &*found : nullptr;
}

const json* FrameKeys::find(std::string_view key) const {
  const json* own = find(Level::frame, key);
  return own != nullptr ? own : find(Level::file, key);
}

std::string FrameKeys::where(Level level, std::string_view key) const {
  return file_ + ": " + (level == Level::frame ? place_ + "." : "") + std::string(key);
}

std::string FrameKeys::where(std::string_view key) const {
  return where(find(Level::frame, key) != nullptr ? Level::frame : Level::file, key);
}

std::optional<double> FrameKeys::number(Level level, std::string_view key) const {
  const json* value = find(level, key);
  return value == nullptr ? std::nullopt : std::optional(to_number(*value, where(level, key)));
}

std::optional<double> FrameKeys::number(std::string_view key) const {
  const auto own = number(Level::frame, key);
  return own ? own : number(Level::file, key);
}

bool FrameKeys::flag(std::string_view key) const {
  const json* value = find(key);
  return value != nullptr && to_flag(*value, where(key));
}

std::optional<double> FrameKeys::positive(Level level, std::string_view key, double limit) const {
  const auto value = number(level, key);
  if (value && !(*value > 0 && *value < limit))
    throw Error("{} is {}, but must lie between 0 and {:.6g}; correct it", where(level, key), *value, limit);
  return value;
}

int FrameKeys::side(std::string_view key) const {
  for (const Level level : {Level::frame, Level::file})
    if (const auto value = positive(level, key, 1e6)) return std::max(1, static_cast<int>(std::lround(*value)));
  return 0;
}

}  // namespace trisoup::scene
