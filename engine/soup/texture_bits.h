// Textures in fewer bits than the bytes that hold them. A picture of such bytes packs into that much less, and whoever reads it needs not know.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup::soup {

/// The nearest of 2^bits values that are spread evenly over 0..255, the ends among them. bits: 1 to 8; with 8 the byte itself. What is at least 128, an opacity
/// that is kept, stays so, and what is below stays below.
constexpr std::uint8_t in_bits(std::uint8_t byte, std::uint32_t bits) {
  const std::uint32_t steps = (1u << bits) - 1;
  const std::uint32_t step = (2 * byte * steps + 255) / 510;
  return static_cast<std::uint8_t>((2 * step * 255 + steps) / (2 * steps));
}

inline void reduce_to_bits(std::span<std::uint8_t> bytes, std::uint32_t bits) {
  if (bits == 8) return;
  for (std::uint8_t& byte : bytes) byte = in_bits(byte, bits);
}

}  // namespace trisoup::soup
