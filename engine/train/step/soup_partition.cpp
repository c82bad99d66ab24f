#include "train/step/soup_partition.h"

namespace trisoup::train {

std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks) {
  // Logits and moments in floats, and what a triangle has besides them.
  constexpr std::uint64_t kBesides = 8;
  const auto size_of = [&](const soup::TextureEntry& row) {
    return kBesides + soup::samples_in(row.level_min, row.level_max);
  };
  std::uint64_t total = 0, so_far = 0;
  for (const soup::TextureEntry& row : table) total += size_of(row);
  std::vector<TriangleRange> ranges;
  std::uint32_t t = 0;
  for (int r = 1; r <= ranks; ++r) {
    const std::uint32_t first = t;
    const std::uint64_t until = total * static_cast<std::uint64_t>(r) / static_cast<std::uint64_t>(ranks);
    while (t < table.size() && (r == ranks || so_far + size_of(table[t]) / 2 < until)) so_far += size_of(table[t++]);
    ranges.push_back({first, t});
  }
  return ranges;
}

SoupPartition& whole_soup() {
  static SoupPartition whole;
  return whole;
}

}  // namespace trisoup::train
