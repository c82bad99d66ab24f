// Text from a file, made fit for a one-line message or for JSON.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trisoup {

/// `text` with control characters replaced by '?' and cut to 120 characters: names in a damaged file must not break the
/// one-line promise of Error.
std::string printable(std::string_view text);

/// "a, b and 3 more", eight names at most, each printable().
std::string some_names(const std::vector<std::string>& names);

/// `text` with what is not UTF-8 replaced by U+FFFD: JSON takes nothing else, and file names may hold any byte.
std::string utf8(std::string_view text);

}  // namespace trisoup
