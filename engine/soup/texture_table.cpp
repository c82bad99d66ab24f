#include "soup/texture_table.h"

#include "base/error.h"

namespace trisoup::soup {
namespace {

template <typename LevelsOf>
TextureTable lay_out(std::size_t triangles, LevelsOf&& levels_of) {
  constexpr std::uint64_t kLimit = (1ull << 31) / kChannels;  // kernels use signed 32-bit indices of values
  TextureTable table;
  table.entries.reserve(triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const TextureLevels levels = levels_of(t);
    if (levels.level_min > levels.level_max || levels.level_max > static_cast<std::uint32_t>(kMaxLevel))
      throw Error("textures: levels {}..{} of triangle {} are not valid; use 0 <= first <= last <= {}",
                  levels.level_min, levels.level_max, t, kMaxLevel);
    table.entries.push_back({static_cast<std::uint32_t>(table.source_samples),
                             static_cast<std::uint32_t>(table.lattice_samples), levels.level_min, levels.level_max});
    table.source_samples += samples_in(levels.level_min, levels.level_max);
    table.lattice_samples += samples_at(levels.level_max);
    // Checked in the loop: the sum cannot overflow 64 bits, and a soup that is too large fails before it fills the
    // memory.
    if (table.source_samples > kLimit)
      throw Error(
          "textures: {} triangles at levels up to {} need more than 2^28 samples; lower the triangle budget or the "
          "level",
          triangles, levels.level_max);
  }
  return table;
}

}  // namespace

TextureLevels as_fine_as(double samples, TextureLevels levels) {
  std::uint32_t level = levels.level_min;
  while (level < levels.level_max && 0.5 * static_cast<double>(1ull << (2 * level)) < samples) ++level;
  return {levels.level_min, level};
}

TextureTable make_texture_table(std::span<const TextureLevels> levels) {
  return lay_out(levels.size(), [&](std::size_t t) { return levels[t]; });
}

TextureTable make_texture_table(std::size_t triangles, TextureLevels levels) {
  return lay_out(triangles, [&](std::size_t) { return levels; });
}

}  // namespace trisoup::soup
