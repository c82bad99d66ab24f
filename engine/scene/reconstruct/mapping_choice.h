// Which mappings COLMAP makes of the same matches, and which of them is used.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace trisoup::scene {

/// What is known of a mapping.
struct Mapping {
  std::size_t registered = 0;  // photographs with a pose, in its largest part
  std::string problem;         // why its cameras cannot be true; empty: they can
  double error = 0;            // mean reprojection error, pixels
};

struct MapperTry {
  std::string how;  // what differs from COLMAP's way, for messages; empty: nothing
  std::vector<std::string> arguments;
};

/// Whether no other mapping is needed: the cameras can be true, and at most one photograph of twenty has no pose.
bool is_good(const Mapping& mapping, std::size_t photographs);

/// Returns how to map next, or nullopt if that is enough. so_far: the mappings made, in order. photographs: all that
/// were compared. has_exif: EXIF tells the focal length of most photographs.
///
/// The first mapping is COLMAP's own. Others accept points under narrower angles and photographs with fewer matches. If
/// cameras cannot be true, they also hold what went astray: focal lengths at EXIF's, distortion at none.
std::optional<MapperTry> next_try(std::span<const Mapping> so_far, std::size_t photographs, bool has_exif);

/// Returns the index of the best: the most photographs with poses, of which three in cameras that cannot be true count
/// as two; then true cameras; then the lowest error. mappings: not empty.
std::size_t best_mapping(std::span<const Mapping> mappings);

/// Returns the smallest part of a broken mapping that COLMAP keeps. A small first part would take its photographs away
/// from later, larger ones.
std::size_t smallest_part(std::size_t photographs);

/// Parts of a mapping that share no points, and what would connect them.
struct Pieces {
  /// Number of photographs of each part, the largest first.
  std::vector<std::size_t> sizes;
  /// Names of neighbours of which one is in the largest part and one in another; empty: there are none.
  std::string from, to;
};

/// parts: names of the photographs of each part; not empty. The first of the largest counts as the largest.
Pieces pieces_of(std::span<const std::vector<std::string>> parts);

}  // namespace trisoup::scene
