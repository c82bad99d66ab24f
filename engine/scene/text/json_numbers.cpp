#include "scene/text/json_numbers.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "base/error.h"
#include "scene/text/number_text.h"
#include "scene/text/text_encoding.h"

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

nlohmann::json parse_json(std::string_view marked, const std::string& name) {
  const std::string_view text = without_byte_order_mark(marked, name);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::exception&) {  // perhaps for NaN, which Python writes
  }
  const std::string mended = mend_json_numbers(text);
  try {
    return nlohmann::json::parse(mended);
  } catch (const nlohmann::json::parse_error& problem) {
    const auto end = mended.begin() + static_cast<std::ptrdiff_t>(std::min(problem.byte, mended.size()));
    // problem.byte is one past the last byte read. A newline there still belongs to the line that it ends.
    const auto line = 1 + std::count(mended.begin(), end == mended.begin() ? end : end - 1, '\n');
    throw Error("{}: line {} is not valid JSON; correct or export the file again", name, line);
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: contains a number out of range; correct or export the file again", name);
  }
}

}  // namespace trisoup::scene
