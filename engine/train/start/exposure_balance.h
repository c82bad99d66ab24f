// Exposures of photographs from the colours in which they show the same places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::train {

/// A photograph's colour of a place.
struct SeenColour {
  std::uint32_t photograph = 0;
  float pixels = 0;        // number of which `colour` is the mean
  glm::vec3 colour{0.0f};  // above 0 and below 1
};

/// Gains of photographs (shaders/common/exposure.h), whose mean is 0: those that minimise the differences between the
/// colours of each place, |c - c'| over all pixels. Iteratively reweighted least squares (Holland and Welsch 1977) in
/// the logarithms of the odds, by conjugate gradients without the places' own colours (as bundle adjustment does; Brown
/// and Lowe 2007 balance panoramas so). Then shrunk together, by how far places contradict the gains (James and Stein
/// 1961). Photographs with too few places get 0.
/// places: colours of each, of different photographs.
std::vector<glm::vec3> balanced_gains(const std::vector<std::vector<SeenColour>>& places, std::size_t photographs);

}  // namespace trisoup::train
