// JSON with numbers that JSON does not have.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace trisoup::scene {

/// First character of the strings that mend_json_numbers() writes. No program writes it.
constexpr char kNotFinite = '\x01';

/// Returns JSON text in which bare words outside of strings are valid: NaN, Infinity and numbers beyond the range of
/// double, as Python writes them, become the string kNotFinite + "NaN"; +1 becomes 1. Other words stay. Keeps line
/// ends.
std::string mend_json_numbers(std::string_view text);

/// Parses JSON, with such words and with a byte order mark. name: of the file, for messages. Throws Error with the line
/// for text that is no JSON.
nlohmann::json parse_json(std::string_view marked, const std::string& name);

}  // namespace trisoup::scene
