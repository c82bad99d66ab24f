// Splits a line of text into words and numbers.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/error.h"
#include "base/printable.h"
#include "scene/text/number_text.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {

/// Removes the next line from `text` and returns it without its end: LF, CR or CRLF. CRCRLF, from converting line ends
/// twice, counts as one end.
inline std::string_view take_line(std::string_view& text) {
  std::size_t end = 0;
  while (end < text.size() && text[end] != '\n' && text[end] != '\r') ++end;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end);
  for (const std::string_view ending : {"\r\r\n", "\r\n", "\n", "\r"})
    if (text.starts_with(ending)) {
      text.remove_prefix(ending.size());
      break;
    }
  return line;
}

class WordReader {
 public:
  /// where: file and line, for messages.
  WordReader(std::string_view line, std::string where) : rest_(line), where_(std::move(where)) { skip_blanks(); }

  bool at_end() const { return rest_.empty(); }
  const std::string& where() const { return where_; }

  /// Returns the next word. Throws RecordError at the end of the line. what: the word's meaning, for messages.
  std::string_view word(const char* what) {
    if (at_end()) throw RecordError(where_, fmt::format("ends before its {}; correct or export the file again", what));
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    rest_.remove_prefix(word.size());
    skip_blanks();
    return word;
  }

  /// Returns the next word as a number (see parse_number). A whole number may be written as 64.0. Throws RecordError at
  /// the end of the line, if the word is not a number, or if T cannot represent it.
  template <typename T>
  T number(const char* what) {
    const std::string_view text = word(what);
    T value{};
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem == std::errc{} && end == text.data() + text.size()) return value;
    if (const auto number = parse_number(text)) {
      if constexpr (std::is_floating_point_v<T>) return static_cast<T>(*number);
      constexpr double exact = 9007199254740992.0;  // 2^53: doubles have all whole numbers up to here
      const double most = std::min(exact, static_cast<double>(std::numeric_limits<T>::max()));
      const double least = std::max(-exact, static_cast<double>(std::numeric_limits<T>::min()));
      if (*number >= least && *number <= most && std::floor(*number) == *number) return static_cast<T>(*number);
    }
    throw_unusable(text, what);
  }

  /// Returns the rest of the line without trailing blanks.
  std::string_view remainder() const {
    const auto last = rest_.find_last_not_of(blanks);
    return last == std::string_view::npos ? std::string_view{} : rest_.substr(0, last + 1);
  }

 private:
  static constexpr const char* blanks = " \t\v\f\r";
  [[noreturn]] void throw_unusable(std::string_view text, const char* what) const {
    if (const std::string foreign = foreign_number(text); !foreign.empty())
      throw RecordError(where_, fmt::format("its {} is written {}", what, foreign),
                        fmt::format("its {} is '{}', {}", what, printable(text), foreign), true);
    throw RecordError(
        where_, fmt::format("its {} is not a usable number; correct or export the file again", what),
        fmt::format("its {} is '{}', not a usable number; correct or export the file again", what, printable(text)));
  }
  void skip_blanks() {
    const auto start = rest_.find_first_not_of(blanks);
    rest_.remove_prefix(start == std::string_view::npos ? rest_.size() : start);
  }

  std::string_view rest_;
  std::string where_;
};

}  // namespace trisoup::scene
