#include "format/lattice_code.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <memory>

#include "base/error.h"
#include "format/range_coder.h"

namespace trisoup::soup {
namespace {

/// Index of the half octave that contains n >= 1: 0 for 1, 2 for 2, 3 for 3, 4 for 4 and 5, 5 for 6 and 7.
int half_octave(std::uint32_t n) {
  const int octave = std::bit_width(n) - 1;
  return octave == 0 ? 0 : 2 * octave + static_cast<int>(n >> (octave - 1) & 1);
}

/// Adaptive probabilities of all decisions. The context of a difference is the differences at the two coarser samples,
/// the previous differences in the triangle, and those of the other features at the same sample. `Coder` is
/// RangeEncoder or RangeDecoder.
template <typename Coder>
class LatticeCode {
 public:
  explicit LatticeCode(Coder& coder) : coder_(coder) {}

  std::uint32_t level(std::uint32_t level) {
    std::uint32_t node = 1;
    for (int bit = 2; bit >= 0; --bit)
      node = node << 1 | std::uint32_t(coder_.decide(levels_[last_level_][node], level >> bit & 1));
    return last_level_ = node & 7;
  }

  /// Codes the differences of one triangle, kChannels per sample. An encoder reads `differences`, a decoder writes
  /// them.
  void triangle(std::uint32_t level, std::span<int> differences) {
    // Decaying mean of the absolute differences so far, in sixteenths.
    std::array<int, kChannels> recent;
    recent.fill(32);
    for (const Refinement& p : refinement(level)) {
      int* here = &differences[p.sample * kChannels];
      const std::uint32_t kind = p.depth == 0 ? 3 : std::min(level - p.depth, 2u);
      for (int c = 0; c < kChannels; ++c) {
        const int between =
            p.depth == 0 ? 0 : std::abs(differences[p.a * kChannels + c]) + std::abs(differences[p.b * kChannels + c]);
        const int near = std::min(15, half_octave(static_cast<std::uint32_t>(4 + 4 * between + recent[c])) - 4);
        const int one = c > 0 ? here[c - 1] : 0, two = c > 1 ? here[c - 2] : 0;
        const int beside = std::min(7, half_octave(static_cast<std::uint32_t>(1 + 2 * std::abs(one) + std::abs(two))));
        here[c] = difference(here[c], Place{kind, c, near, beside, 3 * sign_of(one) + sign_of(two)});
        recent[c] += (16 * std::abs(here[c]) - recent[c]) >> 2;
      }
    }
  }

 private:
  struct Place {
    std::uint32_t kind;
    int channel, near, beside, signs;
  };
  static int sign_of(int difference) { return difference < 0 ? 0 : difference == 0 ? 1 : 2; }

  int difference(int value, const Place& at) {
    if (!coder_.decide(zero_[at.kind][at.channel][at.near][at.beside], value != 0)) return 0;
    const bool negative = coder_.decide(sign_[at.channel][at.signs], value < 0);
    const auto size = static_cast<std::uint32_t>(std::abs(value));
    const int bits = std::bit_width(size) - 1;
    int n = 0;
    while (n < 7 && coder_.decide(bits_[at.kind][at.near][at.beside][n], n < bits)) ++n;
    std::uint32_t number = 1;
    for (int bit = n - 1; bit >= 0; --bit)
      number = number << 1 | std::uint32_t(coder_.decide(rest_[n][at.channel][std::min(number, 63u)], size >> bit & 1));
    return negative ? -static_cast<int>(number) : static_cast<int>(number);
  }

  Coder& coder_;
  std::uint32_t last_level_ = 0;
  Chance levels_[8][8];
  Chance zero_[4][kChannels][16][8];
  Chance sign_[kChannels][9];
  Chance bits_[4][16][8][7];
  Chance rest_[8][kChannels][64];
};

/// Returns the smallest difference that gives `value`. Throws Error if there is none.
int difference_to(int value, int a, int b, int step) {
  const int away = value - (a + b + 1) / 2, steps = (std::abs(away) + step - 1) / step;
  const int difference = away < 0 ? -steps : steps;
  if (refined(a, b, difference, step) != value)
    throw Error("model: a texture value is not rounded to steps of {}; round its textures first", step);
  return difference;
}

}  // namespace

std::vector<std::byte> encode_lattices(std::span<const std::uint8_t> lattice, std::span<const TextureEntry> textures,
                                       const TextureSteps& steps) {
  RangeEncoder encoder;
  const auto code = std::make_unique<LatticeCode<RangeEncoder>>(encoder);
  std::array<int, std::size_t(samples_at(kMaxLevel)) * kChannels> differences;
  for (const TextureEntry& row : textures) {
    const std::uint8_t* values = &lattice[std::size_t(row.lattice_offset) * kChannels];
    for (const Refinement& p : refinement(row.level_max))
      for (int c = 0; c < kChannels; ++c) {
        const int a = p.a == Refinement::kNone ? 128 : values[p.a * kChannels + c],
                  b = p.b == Refinement::kNone ? 128 : values[p.b * kChannels + c];
        differences[p.sample * kChannels + c] = difference_to(values[p.sample * kChannels + c], a, b, steps[c]);
      }
    code->level(row.level_max);
    code->triangle(row.level_max, differences);
  }
  return encoder.finish();
}

Lattices decode_lattices(std::span<const std::byte> bytes, std::size_t triangles, const TextureSteps& steps,
                         const std::string& name) {
  RangeDecoder decoder(bytes);
  const auto code = std::make_unique<LatticeCode<RangeDecoder>>(decoder);
  std::array<int, std::size_t(samples_at(kMaxLevel)) * kChannels> differences;
  Lattices lattices;
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::uint32_t level = code->level(0);
    if (level > static_cast<std::uint32_t>(kMaxLevel) || decoder.missing() > 0)
      throw Error("{}: its textures are truncated or damaged; export or copy the file again", name);
    code->triangle(level, differences);
    const std::size_t begin = lattices.values.size();
    lattices.levels.push_back(level);
    lattices.values.resize(begin + std::size_t(samples_at(level)) * kChannels);
    std::uint8_t* values = &lattices.values[begin];
    for (const Refinement& p : refinement(level))
      for (int c = 0; c < kChannels; ++c) {
        const int a = p.a == Refinement::kNone ? 128 : values[p.a * kChannels + c],
                  b = p.b == Refinement::kNone ? 128 : values[p.b * kChannels + c];
        values[p.sample * kChannels + c] =
            static_cast<std::uint8_t>(refined(a, b, differences[p.sample * kChannels + c], steps[c]));
      }
  }
  if (decoder.missing() > 0) throw Error("{}: its textures are truncated; export or copy the file again", name);
  return lattices;
}

}  // namespace trisoup::soup
