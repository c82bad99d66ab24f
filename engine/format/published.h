// The files of the published viewer: a mesh, two look-up textures, the MLP and a few numbers as JSON (docs/viewer.md).
// Every triangle has the same texture level there, and vertices are in dataset coordinates.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <glm/glm.hpp>

#include "format/model_file.h"
#include "soup/soup.h"

namespace trisoup::soup {

inline constexpr const char *kPublishedMesh = "mesh.ply", *kPublishedScenes = "models.json";

/// The model with the textures of all triangles at one level, at least its highest: a coarser lattice evaluated at the
/// finer one's points, which gives the same picture but for rounding to bytes. Throws Error on a level above kMaxLevel,
/// or below one that there is.
Model at_one_level(const Model& model, std::uint32_t level);

/// Writes `data`/`name`/ with the model at its highest level, and puts `name` into the list `data`/models.json. up: of
/// the dataset. Throws Error where a file cannot be written, and on a list that is none.
void write_published(const std::filesystem::path& data, const std::string& name, const Model& model,
                     const glm::dvec3& up);

/// True for a folder that write_published or the published code made.
bool is_published(const std::filesystem::path& folder);

/// Reads one scene's folder. Its own space is its normalised space but for a similarity that brings most vertices to
/// unit extent. Throws Error on files that are missing, damaged, or do not belong together.
ModelFile read_published(const std::filesystem::path& folder);

}  // namespace trisoup::soup
