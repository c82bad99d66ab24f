// Reads decimal numbers of text formats, independent of the locale.
#pragma once

#include <cmath>
#include <optional>
#include <string_view>

#include "scene/text/number_text.h"

namespace trisoup::scene {

/// Returns `text` without blanks and line ends at both sides.
inline std::string_view trimmed(std::string_view text) {
  constexpr const char* blanks = " \t\v\f\r\n";
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// Reads all of `text`, apart from blanks around it, as a finite number (see parse_number). Returns nullopt for others.
inline std::optional<double> parse_decimal(std::string_view text) {
  const auto value = parse_number(trimmed(text));
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Returns whether `text` is a number with a decimal comma, as programs write it under some locales.
inline bool has_decimal_comma(std::string_view text) {
  text = trimmed(text);
  return text.find(',') != std::string_view::npos &&
         text.find_first_not_of("0123456789+-eE,") == std::string_view::npos;
}

}  // namespace trisoup::scene
