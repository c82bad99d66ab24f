// Similarity of words, for hints about misspelt names.
#pragma once

#include <cstddef>
#include <string_view>

namespace trisoup {

/// Returns the least number of changes that turn `a` into `b`: characters inserted, removed or replaced, and neighbours
/// swapped (optimal string alignment distance).
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace trisoup
