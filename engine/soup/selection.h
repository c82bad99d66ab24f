// Parts of a model.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "soup/soup.h"

namespace trisoup::soup {

/// Returns the model of the triangles `kept` (indices, distinct), in that order, with their textures only. Everything
/// else stays as it is.
Model selected(const Model& model, std::span<const std::uint32_t> kept);

/// Returns each triangle's mean colour, 0..1, over the samples that are drawn (opacity of at least one half). If none
/// is drawn, over all. baked: see bake_colours.
std::vector<glm::vec3> mean_colours(const Model& model, std::span<const std::uint8_t> baked);

}  // namespace trisoup::soup
