// Reads the textures of version 1 model files: PNG atlas pages, two images per page for the eight features.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <nlohmann/json.hpp>

#include "format/model_parts.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Returns the number of texels in a PNG's header, or 0 if it is not a PNG. Check it before memory is allocated.
std::uint64_t png_texels(std::span<const std::byte> png);

/// Fills textures and lattice of a model whose vertices are already read. Memory use is limited by the size of the
/// file. Throws Error if the data is damaged and json::exception if a member is missing or has the wrong type.
void read_atlas_textures(const ModelParts& parts, const nlohmann::json& extension, Model& model);

}  // namespace trisoup::soup
