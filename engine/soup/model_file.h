// model.glb: a glTF 2.0 file that any viewer opens, with the neural textures in an extension (docs/format.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "soup/soup.h"

namespace trisoup::soup {

struct ModelFileOptions {
  std::optional<glm::dvec3> up;           // of the dataset; glTF viewers get it as +Y. Without one +Y is taken as it is.
  std::vector<glm::vec3> bake_directions; // see bake_colours
  nlohmann::json settings;                // kept as it is, for people and for soup-eval
};

struct ModelFile {
  Model model;
  nlohmann::json settings;
};

std::vector<std::byte> encode_model(const Model& model, const ModelFileOptions& options);

/// Throws Error on anything that is not a whole model file. `name` begins error messages.
ModelFile decode_model(std::span<const std::byte> bytes, const std::string& name);

/// Writes atomically; returns the size in bytes.
std::uint64_t write_model(const std::filesystem::path& path, const Model& model, const ModelFileOptions& options);
ModelFile read_model(const std::filesystem::path& path);

}  // namespace trisoup::soup
