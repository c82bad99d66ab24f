// A picture in as many colours as a byte can tell apart.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"

namespace trisoup {

/// At most 256 colours, and which of them each pixel has.
struct PaletteImage {
  int width = 0, height = 0;
  std::vector<glm::u8vec4> colours;  // RGBA; those with alpha 0 first, then by lightness
  std::vector<std::uint8_t> pixels;  // row after row
};

/// RGB by median cut (Heckbert 1982), then the nearest of the means (k-means); alpha becomes 255 from 128 on and 0
/// below. Pixels that `used` (as many as the image has) leaves out may take any colour. The same image gives the same
/// bits.
PaletteImage make_palette(const Image& image, const std::vector<bool>& used);

/// A PNG of 8-bit indices. `name` begins error messages.
std::string encode_png(const PaletteImage& image, const std::string& name);

}  // namespace trisoup
