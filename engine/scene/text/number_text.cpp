#include "scene/text/number_text.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <limits>

namespace trisoup::scene {
namespace {

bool is_nan_of_windows(std::string_view lower) {
  if (!lower.starts_with("1.#")) return false;
  return lower.size() > 3 && std::all_of(lower.begin() + 3, lower.end(),
                                         [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; });
}

/// Returns whether a word is nan or nan(...), as C writes it.
bool is_nan_of_c(std::string_view lower) {
  return lower == "nan" || (lower.starts_with("nan(") && lower.ends_with(')'));
}

}  // namespace

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+')) {
    word.remove_prefix(1);
    if (word.starts_with('-')) return std::nullopt;
  }
  double value = 0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end == word.data() + word.size() && problem == std::errc{}) return value;
  const bool negative = word.starts_with('-');
  const double sign = negative ? -1 : 1;
  if (end == word.data() + word.size() && problem == std::errc::result_out_of_range) {
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    return tiny ? sign * 0 : sign * std::numeric_limits<double>::infinity();
  }
  if (negative) word.remove_prefix(1);
  constexpr std::size_t longest = 32;  // no spelling of a special value is longer
  if (word.size() > longest) return std::nullopt;
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (lower.starts_with("1.#inf")) return sign * std::numeric_limits<double>::infinity();
  if (is_nan_of_c(lower) || is_nan_of_windows(lower)) return std::numeric_limits<double>::quiet_NaN();
  return std::nullopt;
}

std::string foreign_number(std::string_view word) {
  const auto comma = word.find(',');
  if (comma != std::string_view::npos && word.find('.') == std::string_view::npos && comma + 1 < word.size()) {
    std::string turned(word);
    turned[comma] = '.';
    if (parse_number(turned))
      return "with a decimal comma; write decimal points (set the locale to C) and export the file again";
  }
  // Apostrophe, right quotation mark, no-break space and narrow no-break space separate thousands in some locales.
  for (const char* separator : {",", ";", "'", "\xe2\x80\x99", "\xc2\xa0", "\xe2\x80\xaf"})
    if (const auto at = word.find(separator); at != std::string_view::npos && parse_number(word.substr(0, at)))
      return "with separators in or behind it; write numbers plainly (locale C), with blanks between them";
  return {};
}

}  // namespace trisoup::scene
