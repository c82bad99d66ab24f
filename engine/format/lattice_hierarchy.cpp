#include "format/lattice_hierarchy.h"

#include <cmath>

#include "common/host.h"

namespace trisoup::soup {
namespace {

std::vector<Refinement> make_refinement(std::uint32_t level) {
  const int r = 1 << level;
  const auto index = [](int x, int y) { return static_cast<std::uint32_t>(f32::lattice_index(x, y)); };
  const std::uint32_t first = index(0, 0), right = index(r, 0), below = index(0, r);
  std::vector<Refinement> all{
      {first, Refinement::kNone, Refinement::kNone, 0}, {right, first, first, 0}, {below, first, right, 0}};
  for (std::uint32_t depth = 1; depth <= level; ++depth) {
    const int h = r >> depth;  // distance between samples of this depth
    for (int y = 0; y <= r; y += h)
      for (int x = 0; x + y <= r; x += h) {
        const int odd_x = x / h & 1, odd_y = y / h & 1;
        if (!odd_x && !odd_y) continue;
        // The sample halves an edge of a coarser cell along x, y or the diagonal.
        const int dx = odd_x ? h : 0, dy = odd_y ? (odd_x ? -h : h) : 0;
        all.push_back({index(x, y), index(x - dx, y - dy), index(x + dx, y + dy), depth});
      }
  }
  return all;
}

/// Differences smaller than this, in tenths of a step, are rounded to 0. Measured: docs/decisions.md.
constexpr int kDeadZone = 6;

int rounded_difference(int difference, int step, bool corner) {
  const int size = std::abs(difference), add = corner ? 5 : 10 - kDeadZone;
  const int steps = (10 * size + add * step) / (10 * step);
  return difference < 0 ? -steps : steps;
}

/// In a fully opaque triangle, opacities above one half do not affect the picture. All are set to their mean, which
/// costs almost no bytes.
void level_opacity(std::uint8_t* values, std::uint32_t samples) {
  std::uint32_t sum = 0;
  for (std::uint32_t s = 0; s < samples; ++s) {
    if (values[s * kChannels + 7] < 128) return;
    sum += values[s * kChannels + 7];
  }
  for (std::uint32_t s = 0; s < samples; ++s) values[s * kChannels + 7] = static_cast<std::uint8_t>(sum / samples);
}

}  // namespace

std::span<const Refinement> refinement(std::uint32_t level) {
  static const std::vector<std::vector<Refinement>> levels = [] {
    std::vector<std::vector<Refinement>> all;
    for (std::uint32_t l = 0; l <= static_cast<std::uint32_t>(kMaxLevel); ++l) all.push_back(make_refinement(l));
    return all;
  }();
  return levels[level];
}

TextureSteps texture_steps(std::uint32_t bits) {
  if (bits >= 8) return kExactTextures;
  const auto step = [&](int halves) {
    return static_cast<std::uint8_t>(std::min(128, halves * (1 << (8 - bits)) / 2));
  };
  return {step(2), step(2), step(2), step(3), step(8), step(8), step(8), step(6)};
}

void round_textures(std::span<std::uint8_t> lattice, std::span<const TextureEntry> textures,
                    const TextureSteps& steps) {
  if (steps == kExactTextures) return;
  for (const TextureEntry& row : textures) {
    std::uint8_t* values = &lattice[std::size_t(row.lattice_offset) * kChannels];
    level_opacity(values, samples_at(row.level_max));
    for (const Refinement& p : refinement(row.level_max))
      for (int c = 0; c < kChannels; ++c) {
        std::uint8_t& value = values[p.sample * kChannels + c];
        const int a = p.a == Refinement::kNone ? 128 : values[p.a * kChannels + c];
        const int b = p.b == Refinement::kNone ? 128 : values[p.b * kChannels + c];
        int difference = rounded_difference(value - (a + b + 1) / 2, steps[c], p.depth == 0);
        int now = refined(a, b, difference, steps[c]);
        if (c == 7 && (now >= 128) != (value >= 128)) {
          difference += value >= 128 ? 1 : -1;
          now = refined(a, b, difference, steps[c]);
        }
        value = static_cast<std::uint8_t>(now);
      }
  }
}

}  // namespace trisoup::soup
