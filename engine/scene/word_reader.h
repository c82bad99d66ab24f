// Splits a line of text into words and numbers.
#pragma once

#include <charconv>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::scene {

/// Removes the next line from `text` and returns it without line feed and carriage return.
inline std::string_view take_line(std::string_view& text) {
  const auto end = text.find('\n');
  std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

class WordReader {
 public:
  /// where: file and line, for messages.
  WordReader(std::string_view line, std::string where) : rest_(line), where_(std::move(where)) { skip_blanks(); }

  bool at_end() const { return rest_.empty(); }
  const std::string& where() const { return where_; }

  /// Returns the next word. Throws Error at the end of the line. what: the word's meaning, for messages.
  std::string_view word(const char* what) {
    if (at_end()) throw Error("{}: ends before its {}; correct or export the file again", where_, what);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks));
    rest_.remove_prefix(word.size());
    skip_blanks();
    return word;
  }

  /// Returns the next word as a number. Throws Error at the end of the line, if it is not a number, or if T cannot
  /// represent it.
  template <typename T>
  T number(const char* what) {
    const std::string_view text = word(what);
    T value{};
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem != std::errc{} || end != text.data() + text.size()) {
      if constexpr (std::is_floating_point_v<T>)  // numbers too small for T become zero, as in other readers
        if (problem == std::errc::result_out_of_range && end == text.data() + text.size() && is_tiny(text)) return T(0);
      throw Error("{}: its {} is '{}', not a usable number; correct or export the file again", where_, what,
                  printable(text));
    }
    return value;
  }

  /// Returns the rest of the line without trailing blanks.
  std::string_view remainder() const {
    const auto last = rest_.find_last_not_of(blanks);
    return last == std::string_view::npos ? std::string_view{} : rest_.substr(0, last + 1);
  }

 private:
  static constexpr const char* blanks = " \t\v\f\r";
  static bool is_tiny(std::string_view text) {
    return text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
  }
  void skip_blanks() {
    const auto start = rest_.find_first_not_of(blanks);
    rest_.remove_prefix(start == std::string_view::npos ? rest_.size() : start);
  }

  std::string_view rest_;
  std::string where_;
};

}  // namespace trisoup::scene
