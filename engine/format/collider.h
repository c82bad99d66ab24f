// Collision meshes for physics engines: a soup as a plain closed mesh with few triangles.
#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "mesh/mesh.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Returns a closed mesh of at most about `budget` triangles around the opaque parts of a model. The model is
/// rasterised into grid cells, and groups of a few cells are removed. The hull of the cells is moved halfway towards
/// the soup and decimated (decimate.h). Cells are about as large as the triangles the budget allows, so smaller gaps
/// are closed and thin objects have two sides. The grid spans the box that contains nine tenths of the vertices, plus a
/// quarter of its sides, which excludes backdrop and strays. Coordinates are those of model.vertices. Throws Error if
/// nothing is opaque.
Mesh collision_mesh(const Model& model, std::size_t budget);

/// Returns a glTF 2.0 file with that mesh. node: the soup's node, whose transform the mesh gets.
std::vector<std::byte> encode_collider(const Mesh& mesh, const nlohmann::json& node);

}  // namespace trisoup::soup
