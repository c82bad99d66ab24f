// Layout of the triangles' textures in the sample pools. Triangles may have different levels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "soup/soup.h"

namespace trisoup::soup {

/// Texture levels of a triangle: level_min..level_max, at most kMaxLevel.
struct TextureLevels {
  std::uint32_t level_min = 0, level_max = 0;
  bool operator==(const TextureLevels&) const = default;
};

/// Limits `levels` to its first level with at least `samples` samples. Samples are counted as 4^level / 2, that is,
/// border samples count half or less.
TextureLevels as_fine_as(double samples, TextureLevels levels);

struct TextureTable {
  std::vector<TextureEntry> entries;  // one per triangle; textures are stored in triangle order
  std::uint64_t source_samples = 0;   // size of the pool of logits, in samples of kChannels values
  std::uint64_t lattice_samples = 0;  // size of the pool of summed lattices, in samples
  std::size_t triangles() const { return entries.size(); }
};

/// Lays out one texture per element of `levels`. Throws Error unless level_min <= level_max <= kMaxLevel for each
/// element, or if a pool has more samples than a 32-bit offset can address.
TextureTable make_texture_table(std::span<const TextureLevels> levels);

/// The same with equal levels for all triangles.
TextureTable make_texture_table(std::size_t triangles, TextureLevels levels);

}  // namespace trisoup::soup
