// A lattice from coarse to fine: each sample has two coarser ones that it lies between, and is told as what it differs
// from their mean.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "soup/soup.h"

namespace trisoup::soup {

/// One sample of a lattice, by its index in it. Samples come after those that they lie between.
struct Refinement {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t sample = 0, a = kNone, b = kNone;  // kNone for the first sample
  std::uint32_t depth = 0;                         // level of the lattice that has the sample first; the corners are 0
};

/// All samples of a lattice: the corners of vertices 2, 0, 1, then by level and row.
std::span<const Refinement> refinement(std::uint32_t level);

/// How coarsely each feature is told, in 255ths: 1 to 128. A difference is a multiple of its step.
using TextureSteps = std::array<std::uint8_t, kChannels>;
inline constexpr std::size_t kMostStep = 128;
inline constexpr TextureSteps kExactTextures{1, 1, 1, 1, 1, 1, 1, 1};

/// Steps for so many bits a value, 1 to 8: base colours have 2^(8 - bits), the residual's weight half as much again,
/// opacity three times as much, and what only the MLP sees four times; 8 are exact.
TextureSteps texture_steps(std::uint32_t bits);

/// Value of a sample that differs by `difference` steps from what `a` and `b`, the values that it lies between,
/// suggest.
inline int refined(int a, int b, int difference, int step) {
  return std::clamp((a + b + 1) / 2 + difference * step, 0, 255);
}

/// Values of all lattices as steps leave them: differences that are less than 0.6 of a step go, others are rounded. An
/// opacity of at least 128, which is kept, stays so, and one below stays below; triangles that are opaque all over have
/// one opacity. Exact steps leave everything as it is.
void round_textures(std::span<std::uint8_t> lattice, std::span<const TextureEntry> textures, const TextureSteps& steps);

}  // namespace trisoup::soup
