// Which photographs of a sequence are compared besides neighbours.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace trisoup::scene {

/// Number of evenly spaced photographs of a sequence that are compared with each other.
inline constexpr std::size_t kLoopFrames = 40;

/// Returns pairs that close loops of a sequence: each two of about kLoopFrames evenly spaced photographs, unless they
/// are within `overlap` of each other, as those are compared anyway. COLMAP finds such pairs by a vocabulary tree,
/// which is a large file of its own. Ascending; the first of a pair comes before the second.
std::vector<std::pair<std::size_t, std::size_t>> loop_pairs(std::size_t photographs, std::size_t overlap);

/// Returns these pairs as COLMAP's list of matches: one line "NAME NAME" for each pair. Pairs with a blank in a name
/// are left out, as the list cannot hold them.
std::string match_list(const std::vector<std::string>& names,
                       const std::vector<std::pair<std::size_t, std::size_t>>& pairs);

}  // namespace trisoup::scene
