// Images with a palette of at most 256 colours.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"

namespace trisoup {

/// At most 256 colours, and the index of a colour for each pixel.
struct PaletteImage {
  int width = 0, height = 0;
  std::vector<glm::u8vec4> colours;  // RGBA; colours with alpha 0 first, then sorted by lightness
  std::vector<std::uint8_t> pixels;  // [height * width]
};

/// Reduces an image to a palette: median cut (Heckbert 1982), then k-means. Alpha becomes 255 if it is at least 128,
/// else 0. used: [height * width]; the other pixels may get any colour. Deterministic.
PaletteImage make_palette(const Image& image, const std::vector<bool>& used);

/// Encodes a PNG with 8-bit indices. Error messages begin with `name`.
std::string encode_png(const PaletteImage& image, const std::string& name);

}  // namespace trisoup
