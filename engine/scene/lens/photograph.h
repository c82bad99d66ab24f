// Photographs during loading: the type for undistortion and resampling.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"

namespace trisoup::scene {

/// Colour is premultiplied by alpha, so that it can be averaged. Files store straight alpha, often with arbitrary RGB
/// where alpha is 0, and averages of that RGB would bleed into outlines. The loss mask is separate from alpha, because
/// pixels may be excluded for other reasons: a mask file, or positions outside the photograph after undistortion.
struct Photograph {
  int width = 0, height = 0;
  std::vector<glm::u8vec4> colour;   // [height * width], row 0 at the top, premultiplied
  std::vector<std::uint8_t> inside;  // [height * width], 255: in the loss, 0: excluded; empty: all in the loss

  std::size_t pixels() const { return std::size_t(width) * std::size_t(height); }
};

/// What a picture's alpha channel holds.
enum class AlphaFound {
  none,  // 255 everywhere
  some,
  empty,  // at most 8 of 255 everywhere: transparent, or a channel without meaning
};
AlphaFound alpha_of(const Image& straight);

/// Converts an image whose alpha is coverage, to be composited on a background later.
Photograph from_coverage(const Image& straight);

/// Converts an image whose alpha is a loss mask (alpha >= 0.5: in the loss). RGB is unchanged.
Photograph from_mask(const Image& straight);

/// The photograph of a View's image, with the colours of its background where it does not hide it.
Photograph from_view(const Image& image);

/// Returns the image of a View: RGB composited on an opaque background with the grey level `background`, and the loss
/// mask in A.
Image composite(const Photograph& photograph, std::uint8_t background);

}  // namespace trisoup::scene
