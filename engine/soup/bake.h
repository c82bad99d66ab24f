// Baked colours for viewers that do not evaluate the MLP.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "soup/soup.h"

namespace trisoup::soup {

/// Returns the RGB colour of every lattice sample, [samples][3], display values 0..255. It is the mean of the MLP's
/// colours over `directions`, unit vectors from the surface towards the viewer; empty: eight directions around the
/// sphere (DiffSoup, section 3).
std::vector<std::uint8_t> bake_colours(const Model& model, std::span<const glm::vec3> directions);

}  // namespace trisoup::soup
