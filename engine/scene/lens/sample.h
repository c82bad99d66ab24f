// Resamples photographs.
#pragma once

#include <functional>
#include <optional>

#include "scene/lens/photograph.h"

namespace trisoup::scene {

/// How a photograph continues beyond its left and right border. Above and below, the border repeats.
enum class Border {
  clamped,  // the border repeats
  wrapped   // the other border follows, as in a panorama
};

/// Returns a photograph whose pixel (x, y) shows the position source(x, y), sampled bilinearly. Positions are in
/// pixels: the centre of pixel (0, 0) is (0.5, 0.5). nullopt: the pixel is empty and excluded from the loss. If any of
/// the four pixels around a position are in the loss, only those contribute colour.
Photograph resample(const Photograph& photograph, int width, int height, Border border,
                    const std::function<std::optional<glm::dvec2>(int x, int y)>& source);

}  // namespace trisoup::scene
