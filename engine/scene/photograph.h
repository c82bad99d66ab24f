// A photograph on its way from the file to the View: what undistortion and resampling work on.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"

namespace trisoup::scene {

/// Colour is premultiplied by alpha, so that it may be averaged: files store straight alpha, often with arbitrary RGB
/// where alpha is 0, and an average of that RGB would bleed into the outline. The loss mask is apart from alpha,
/// because a pixel may be outside of the loss for other reasons: a mask file, or undistortion that looked past the
/// photograph.
struct Photograph {
  int width = 0, height = 0;
  std::vector<glm::u8vec4> colour;   // height * width, row 0 on top, premultiplied
  std::vector<std::uint8_t> inside;  // height * width, 255 in the loss and 0 outside; empty: all inside

  std::size_t pixels() const { return std::size_t(width) * std::size_t(height); }
};

/// True if any alpha is below 255.
bool uses_alpha(const Image& straight);

/// The photograph of an image whose alpha is coverage, to be composited on a background later.
Photograph from_coverage(const Image& straight);

/// The photograph of an image whose alpha says what is in the loss (alpha >= 0.5). RGB stays as it is.
Photograph from_mask(const Image& straight);

/// Takes every pixel out of the loss where the largest channel of `mask` is below `threshold`. A mask of another size
/// is looked up at the nearest pixel.
void exclude(Photograph& photograph, const Image& mask, int threshold);

/// The finished image of a View: RGB over an opaque background of the grey level `background`, loss mask in A.
Image composite(const Photograph& photograph, std::uint8_t background);

}  // namespace trisoup::scene
