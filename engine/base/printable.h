// Makes text from files safe for one-line messages and for JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trisoup {

/// Replaces control characters with '?' and cuts the text to 120 bytes, so that names from a damaged file cannot break
/// the one-line messages of Error.
std::string printable(std::string_view text);

/// Returns at most eight names, each through printable(): "a, b and 3 more".
std::string some_names(const std::vector<std::string>& names);

/// Replaces invalid UTF-8 with U+FFFD. JSON requires UTF-8, but file names may contain any bytes.
std::string utf8(std::string_view text);

}  // namespace trisoup
