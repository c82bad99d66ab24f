// Coarse-to-fine representation of a lattice: each sample lies between two coarser ones and is stored as the difference
// from their mean.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "soup/soup.h"

namespace trisoup::soup {

/// One sample of a lattice. `sample`, `a` and `b` are indices into the lattice; a and b precede the sample in order.
struct Refinement {
  static constexpr std::uint32_t kNone = 0xffffffffu;
  std::uint32_t sample = 0, a = kNone, b = kNone;  // kNone for the first sample
  std::uint32_t depth = 0;                         // lowest lattice level that contains the sample; 0 for corners
};

/// All samples of a lattice: the corners at vertices 2, 0 and 1, then by level and row.
std::span<const Refinement> refinement(std::uint32_t level);

/// Quantisation step of each feature, in 255ths, 1 to 128. A difference is a multiple of its step.
using TextureSteps = std::array<std::uint8_t, kChannels>;
inline constexpr std::size_t kMostStep = 128;
inline constexpr TextureSteps kExactTextures{1, 1, 1, 1, 1, 1, 1, 1};

/// Steps for `bits` bits per value, 1 to 8. Base colours have step 2^(8 - bits), the residual weight 1.5 times that,
/// opacity 3 times, and the latent features, which only the MLP reads, 4 times. 8 bits are exact.
TextureSteps texture_steps(std::uint32_t bits);

/// Value of a sample that differs by `difference` steps from the mean of `a` and `b`, the values it lies between.
inline int refined(int a, int b, int difference, int step) {
  return std::clamp((a + b + 1) / 2 + difference * step, 0, 255);
}

/// Quantises all lattices with `steps`. Differences below 0.6 of a step become 0, others are rounded. Opacities stay on
/// their side of the threshold 128. Fully opaque triangles get a single opacity. Exact steps change nothing.
void round_textures(std::span<std::uint8_t> lattice, std::span<const TextureEntry> textures, const TextureSteps& steps);

}  // namespace trisoup::soup
