#include "format/model_bytes.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "format/glb.h"
#include "format/lattice_code.h"
#include "format/model_file.h"
#include "format/model_parts.h"

namespace trisoup::soup {

nlohmann::json bytes_by_part(std::span<const std::byte> file, const std::string& name) {
  ModelFile model_file = decode_model(file, name);  // throws if the file is damaged
  const Glb glb = decode_glb(file, name);
  const ModelParts parts{glb, name};
  const nlohmann::json& extension = glb.document.at("extensions").at(kExtension);
  if (!extension.contains("textures"))
    throw Error("{}: files of versions 1 and 2 have no size by part; export the model again", name);
  // Texture coordinates and images exist only with plain colours.
  const nlohmann::json images = glb.document.value("images", nlohmann::json::array());
  const auto accessor = [&](std::size_t index) {
    return parts.view(glb.document.at("accessors").at(index).at("bufferView")).size();
  };
  const std::size_t textures = parts.view(extension["textures"].at("bufferView")).size();
  for (std::size_t i = kChannels - 1; i < model_file.model.lattice.size(); i += kChannels)
    model_file.model.lattice[i] = 128;
  const std::size_t features =
      encode_lattices(model_file.model.lattice, model_file.model.textures, model_file.texture_steps).size();

  nlohmann::json bytes;
  bytes["vertices"] =
      extension.contains("vertices") ? parts.view(extension["vertices"].at("bufferView")).size() : accessor(0);
  bytes["texture_coordinates"] = images.empty() ? 0 : accessor(1);
  bytes["features"] = std::min(features, textures);
  bytes["opacity"] = textures - std::min(features, textures);
  std::size_t colours = 0;
  for (const nlohmann::json& image : images) colours += parts.view(image.at("bufferView")).size();
  bytes["plain_colours"] = colours;
  bytes["mlp"] = parts.view(extension.at("mlp")).size();
  bytes["cameras"] = 0;
  if (extension.contains("cameras")) {
    const nlohmann::json& cameras = extension["cameras"];
    bytes["cameras"] = cameras.dump().size() + (cameras.contains("poses") ? parts.view(cameras["poses"]).size() : 0);
  }
  std::size_t told = 0;
  for (const auto& part : bytes) told += part.get<std::size_t>();
  bytes["rest"] = file.size() - told;
  return bytes;
}

}  // namespace trisoup::soup
