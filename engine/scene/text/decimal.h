// Reads decimal numbers of text formats, independent of the locale.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace trisoup::scene {

/// Returns `text` without blanks and line ends at both sides.
inline std::string_view trimmed(std::string_view text) {
  constexpr const char* blanks = " \t\v\f\r\n";
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// Reads all of `text`, apart from blanks around it, as a number with a decimal point. Numbers too small for a double
/// become zero. Returns nullopt for anything else, infinity and NaN included.
inline std::optional<double> parse_decimal(std::string_view text) {
  text = trimmed(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with('+')) return std::nullopt;
  double value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size()) return std::nullopt;
  if (problem == std::errc::result_out_of_range)
    return text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos ? std::optional(0.0)
                                                                                                  : std::nullopt;
  if (problem != std::errc{} || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Returns whether `text` is a number with a decimal comma, as programs write it under some locales.
inline bool has_decimal_comma(std::string_view text) {
  text = trimmed(text);
  return text.find(',') != std::string_view::npos &&
         text.find_first_not_of("0123456789+-eE,") == std::string_view::npos;
}

}  // namespace trisoup::scene
