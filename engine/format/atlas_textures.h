// Textures of model files of version 1: PNG pages, two for the eight features, in which each lattice has its place.
#pragma once

#include <nlohmann/json.hpp>

#include "format/model_parts.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Fills textures and lattice of a model that has its vertices. Throws Error on what is damaged, before it takes memory
/// that the file does not account for, and json::exception where a member is missing or of another kind.
void read_atlas_textures(const ModelParts& parts, const nlohmann::json& extension, Model& model);

}  // namespace trisoup::soup
