// Numbers as programs write them, independent of the locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace trisoup::scene {

/// Returns the number that a whole word spells: decimal, with an optional sign and exponent; also nan, -nan(ind),
/// inf, infinity, and 1.#QNAN, 1.#IND and 1.#INF of older Windows programs, in any letter case. Too large numbers are
/// infinite, too small ones 0. nullopt: the word is not a number.
std::optional<double> parse_number(std::string_view word);

/// Returns how a word that is not a number was likely written, with the fix: "with a decimal comma; ...". Empty if that
/// is unknown.
std::string foreign_number(std::string_view word);

}  // namespace trisoup::scene
