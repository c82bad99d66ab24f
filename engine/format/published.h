// Reads and writes the files of the published viewer: a mesh, two look-up textures, the MLP and some numbers as JSON
// (docs/viewer.md). All triangles have the same texture level; vertices are in dataset coordinates.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <glm/glm.hpp>

#include "format/model_file.h"
#include "soup/soup.h"

namespace trisoup::soup {

inline constexpr const char *kPublishedMesh = "mesh.ply", *kPublishedScenes = "models.json";

/// Returns the model with all textures at one level. Coarser lattices are evaluated at the finer lattice's points,
/// which gives the same picture except for rounding to bytes. Throws Error if `level` is above kMaxLevel or below the
/// level of a texture.
Model at_one_level(const Model& model, std::uint32_t level);

/// Writes the model at its highest level to `data`/`name`/ and adds `name` to the list `data`/models.json. up: the
/// dataset's up direction. Throws Error if a file cannot be written or the existing list is not valid.
void write_published(const std::filesystem::path& data, const std::string& name, const Model& model,
                     const glm::dvec3& up);

/// Whether a folder was written by write_published or the published code.
bool is_published(const std::filesystem::path& folder);

/// Reads the folder of one scene. centre and scale are set so that most vertices have unit extent in normalised
/// coordinates. Throws Error if files are missing, damaged or do not match each other.
ModelFile read_published(const std::filesystem::path& folder);

}  // namespace trisoup::soup
