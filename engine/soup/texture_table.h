// Where each triangle's texture lies in the pools of samples: triangles may have different levels, and none pays for
// another's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "soup/soup.h"

namespace trisoup::soup {

/// Levels of one triangle's texture: level_min..level_max, at most kMaxLevel.
struct TextureLevels {
  std::uint32_t level_min = 0, level_max = 0;
  bool operator==(const TextureLevels&) const = default;
};

/// `levels` cut off at its first level that has at least `samples` samples, counted as 4^level / 2: those at the border
/// by the half or less.
TextureLevels as_fine_as(double samples, TextureLevels levels);

struct TextureTable {
  std::vector<TextureEntry> entries;  // one per triangle, textures one after the other in triangle order
  std::uint64_t source_samples = 0;   // size of the pool of logits, in samples of kChannels values
  std::uint64_t lattice_samples = 0;  // size of the pool of summed lattices, in samples
  std::size_t triangles() const { return entries.size(); }
};

/// Lays out one texture per element of `levels`. Throws Error unless level_min <= level_max <= kMaxLevel for each of
/// them, or if a pool has more samples than a 32-bit offset can reach.
TextureTable make_texture_table(std::span<const TextureLevels> levels);

/// The same with equal levels for all triangles.
TextureTable make_texture_table(std::size_t triangles, TextureLevels levels);

}  // namespace trisoup::soup
