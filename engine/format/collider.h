// What things bump into and walk on: a soup as a plain closed mesh of few triangles, for the physics of engines.
#pragma once

#include <cstddef>
#include <vector>

#include <nlohmann/json.hpp>

#include "mesh/mesh.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// A closed mesh of at most about `budget` triangles around what is opaque: the cells of a grid that the soup passes
/// through, without specks of a few cells, their hull drawn halfway onto the soup and decimated (decimate.h). Cells are
/// about as large as the triangles that the budget allows, so gaps smaller than that are closed, and thin things have
/// two sides. The grid spans the box that nine tenths of the vertices lie in and a quarter of its sides around it:
/// without a backdrop and strays. In the coordinates of model.vertices. Throws Error where nothing is opaque.
Mesh collision_mesh(const Model& model, std::size_t budget);

/// A glTF 2.0 file with that mesh. node: the soup's own node, whose place in the scene the mesh takes.
std::vector<std::byte> encode_collider(const Mesh& mesh, const nlohmann::json& node);

}  // namespace trisoup::soup
