// model.glb: a glTF 2.0 file that any viewer opens, with the neural textures in an extension (docs/formats.md).
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
  std::optional<glm::dvec3> up;        // of the dataset, where it is known; glTF viewers get it as +Y
  std::optional<glm::dvec3> shown_up;  // where it is not: what they get as +Y instead, for the root node alone. Without
                                       // either +Y is taken as it is.
  bool plain_colours = true;           // for viewers that do not know the extension: a third of a small file
  double vertex_share =
      0;  // without plain colours: how far corners may be off, see on_grid; 0 or no cameras: not at all
  std::vector<glm::vec3> bake_directions;       // unit, from the surface towards the viewer; see bake_colours
  TextureSteps texture_steps = kExactTextures;  // that the model's textures were rounded to; see round_textures
  bool colour_palette = false;  // plain colours of 256 kinds, each sample either opaque or not: a quarter of the bytes
  nlohmann::json settings;      // kept as it is, for people and for soup-eval
  std::vector<ModelCamera> cameras;  // for viewers
  int atlas_side = kAtlasSide;       // largest width and height of an atlas page, texels; see make_atlas
};

struct ModelFile {
  Model model;
  TextureSteps texture_steps =
      kExactTextures;  // those of the file: with them the model is written again in as few bytes
  nlohmann::json settings;
  std::optional<glm::dvec3> up;
  std::vector<ModelCamera>
      cameras;  // as they were written, but for the rounding of code_cameras; none in files before there were any
};

/// The bytes of a model.glb. decode_model gives back the same vertices, lattices and MLP to the bit; lattices lie in
/// triangle order. With a `vertex_share` vertices are rounded and triangles in another order, and other viewers find no
/// mesh. Throws Error on a model that no reader could take: no triangles, another number of vertices, a texture outside
/// the lattice, or with a value that `texture_steps` do not reach, a number that is not finite (training diverged),
/// settings that are not UTF-8, more than the format can hold.
std::vector<std::byte> encode_model(const Model& model, const ModelFileOptions& options);

/// Throws Error on anything that is not a whole model file, before it takes memory that the file does not account for.
/// `name` begins error messages.
ModelFile decode_model(std::span<const std::byte> bytes, const std::string& name);

/// encode_model to a file, atomically; returns its size in bytes. Throws Error as well if it cannot be written.
std::uint64_t write_model(const std::filesystem::path& path, const Model& model, const ModelFileOptions& options);
/// `path`, or where it is the folder of a training the model in it.
std::filesystem::path model_in(const std::filesystem::path& path);
/// decode_model of a file. Throws Error as well if it cannot be read.
ModelFile read_model(const std::filesystem::path& path);

}  // namespace trisoup::soup
