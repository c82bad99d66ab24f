// Similarity of words, for hints about misspelt names.
#pragma once

#include <cstddef>
#include <string_view>

namespace trisoup {

/// Returns the number of characters to insert, remove or replace to turn `a` into `b` (Levenshtein distance).
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace trisoup
