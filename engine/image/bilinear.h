// Bilinear scaling on the host.
#pragma once

#include <cstdint>
#include <span>

namespace trisoup {

/// Pixels of four 8-bit channels, rows from the top, tightly packed.
struct Pixels {
  std::span<const std::uint8_t> bytes;  // 4 width height
  std::uint32_t width = 0, height = 0;
};

/// Scales `from` to width x height pixels as the linear filter of a GPU does: pixels are samples at their centres,
/// edges go on outside. swap_red_blue: channels 0 and 2 change places. to: 4 width height bytes. Weights have 8 bits.
/// Throws Error where sizes do not fit.
void scale_bilinear(const Pixels& from, std::span<std::uint8_t> to, std::uint32_t width, std::uint32_t height,
                    bool swap_red_blue);

}  // namespace trisoup
