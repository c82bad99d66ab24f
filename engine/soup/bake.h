// Colours without a neural network: what a plain viewer shows.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "soup/soup.h"

namespace trisoup::soup {

/// RGB of every lattice sample, [samples][3], display values 0..255: the mean over `directions` (unit vectors from the
/// surface towards the viewer; empty: eight around the sphere) of the colour that the MLP gives it (DiffSoup, section
/// 3).
std::vector<std::uint8_t> bake_colours(const Model& model, std::span<const glm::vec3> directions);

}  // namespace trisoup::soup
