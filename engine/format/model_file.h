// model.glb: a glTF 2.0 file that any glTF viewer opens. An extension holds the neural textures (docs/formats.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "format/lattice_hierarchy.h"
#include "format/model_cameras.h"
#include "soup/atlas.h"
#include "soup/soup.h"

namespace trisoup::soup {

struct ModelFileOptions {
  std::optional<glm::dvec3> up;  // the dataset's up direction, if known; the root node turns it to +Y
  /// Used for the root node if `up` is not known. Without either, +Y is up.
  std::optional<glm::dvec3> shown_up;
  bool plain_colours = true;  // baked colours for viewers without the extension; a third of a small file
  /// Without plain colours: precision of the vertices, see on_grid. 0 or no cameras: vertices are stored exactly.
  double vertex_share = 0;
  /// RGB of every sample for `plain_colours`, [samples][3]: train::fitted_colours(). Empty: bake_colours().
  std::vector<std::uint8_t> baked;
  TextureSteps texture_steps = kExactTextures;  // the steps the textures were rounded to; see round_textures
  bool colour_palette = false;       // plain colours of 256 colours with binary opacity; a quarter of the bytes
  nlohmann::json settings;           // training settings, stored as they are
  std::vector<ModelCamera> cameras;  // for viewers
  int atlas_side = kAtlasSide;       // largest width and height of an atlas page, texels; see make_atlas
};

struct ModelFile {
  Model model;
  /// The steps of the file. Writing the model with them again gives the same size.
  TextureSteps texture_steps = kExactTextures;
  nlohmann::json settings;
  std::optional<glm::dvec3> up;
  std::vector<ModelCamera> cameras;  // rounded by code_cameras; empty if the file has none
};

/// Returns the bytes of a model.glb. decode_model restores vertices, lattices and MLP exactly; lattices are in triangle
/// order. With a `vertex_share`, vertices are rounded, triangles are reordered, and the file has no mesh for other
/// viewers. Throws Error if the model is not valid: no triangles, a wrong number of vertices, a texture outside the
/// lattice, a value that is not rounded to `texture_steps`, a value that is not finite (training diverged), a camera,
/// centre or scale that decode_model would refuse, settings that are not UTF-8, or more data than the format can hold.
std::vector<std::byte> encode_model(const Model& model, const ModelFileOptions& options);

/// Decodes a model file. Memory use is limited by the size of the file. Throws Error if the file is not a complete,
/// undamaged model. `name` begins error messages.
ModelFile decode_model(std::span<const std::byte> bytes, const std::string& name);

/// Writes encode_model() to a file atomically and returns its size in bytes. Also throws Error if it cannot be written.
std::uint64_t write_model(const std::filesystem::path& path, const Model& model, const ModelFileOptions& options);
/// Returns `path`, or the model in it if it is the folder of a training.
std::filesystem::path model_in(const std::filesystem::path& path);
/// Reads and decodes a file. Also throws Error if it cannot be read.
ModelFile read_model(const std::filesystem::path& path);

}  // namespace trisoup::soup
