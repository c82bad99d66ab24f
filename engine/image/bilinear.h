// Bilinear scaling on the host.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup {

/// Pixels of four 8-bit channels, rows from the top, tightly packed.
struct Pixels {
  std::span<const std::uint8_t> bytes;  // [height * width * 4]
  std::uint32_t width = 0, height = 0;
};

/// Scales `from` to width x height pixels like the linear filter of a GPU: samples are at pixel centres, and
/// coordinates are clamped to the edge. Weights have 8 bits.
/// to: [height * width * 4]. swap_red_blue: exchanges channels 0 and 2. Throws Error if the sizes do not match.
void scale_bilinear(const Pixels& from, std::span<std::uint8_t> to, std::uint32_t width, std::uint32_t height,
                    bool swap_red_blue);

}  // namespace trisoup
