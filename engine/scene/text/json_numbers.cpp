#include "scene/text/json_numbers.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "scene/text/number_text.h"

namespace trisoup::scene {
namespace {

bool is_of_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("+-.#()_").find(c) != std::string_view::npos;
}

/// Returns the end of the string that starts at `start`, behind its closing quotation mark.
std::size_t end_of_string(std::string_view text, std::size_t start) {
  std::size_t end = start + 1;
  while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2 : 1;
  return std::min(end + 1, text.size());
}

}  // namespace

std::string mend_json_numbers(std::string_view text) {
  std::string mended;
  mended.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = at;
    if (text[at] == '"') {
      end = end_of_string(text, at);
      mended.append(text.substr(at, end - at));
    } else if (!is_of_word(text[at])) {
      mended += text[at];
      end = at + 1;
    } else {
      while (end < text.size() && is_of_word(text[end])) ++end;
      const std::string_view word = text.substr(at, end - at);
      const auto number = parse_number(word);
      if (number && !std::isfinite(*number))
        mended += "\"\\u0001NaN\"";
      else
        mended += number && word.starts_with('+') ? word.substr(1) : word;
    }
    at = end;
  }
  return mended;
}

}  // namespace trisoup::scene
