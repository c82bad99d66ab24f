#include "format/plain_colours.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/printable.h"
#include "format/atlas_textures.h"
#include "format/model_file.h"
#include "format/model_parts.h"
#include "image/image_file.h"
#include "soup/atlas.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;

/// Reads the values of an accessor that must have `count` times `components` values of four bytes.
template <typename T>
std::vector<T> values_of(const ModelParts& parts, const json& index, std::size_t components) {
  const json& accessor = parts.glb.document.at("accessors").at(parts.whole(index));
  const std::span<const std::byte> bytes = parts.view(accessor.at("bufferView"));
  if (bytes.size() % (components * sizeof(T)) != 0 ||
      bytes.size() / (components * sizeof(T)) != parts.whole(accessor.at("count")))
    throw parts.damaged("its mesh has a list of the wrong length");
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

/// Decodes the texture of a primitive. most: texels that it may have.
Image texture_of(const ModelParts& parts, const json& primitive, std::uint64_t most) {
  const json& gltf = parts.glb.document;
  const json& material = gltf.at("materials").at(parts.whole(primitive.at("material")));
  const json& texture =
      gltf.at("textures").at(parts.whole(material.at("pbrMetallicRoughness").at("baseColorTexture").at("index")));
  const std::span<const std::byte> png =
      parts.view(gltf.at("images").at(parts.whole(texture.at("source"))).at("bufferView"));
  const std::uint64_t texels = png_texels(png);
  if (texels == 0) throw parts.damaged("a texture is not a PNG");
  if (texels > most) throw parts.damaged("its textures have more texels than its triangles need");
  return decode_image(png, parts.name + " (texture)");
}

/// Copies the texels of a triangle to its samples.
void take_texels(const ModelParts& parts, const Image& image, const float* uv, std::size_t triangle, Model& model) {
  const TextureEntry& row = model.textures[triangle];
  glm::ivec2 corners[3];
  for (int k = 0; k < 3; ++k) {
    const glm::vec2 at = glm::vec2(uv[2 * k], uv[2 * k + 1]) * glm::vec2(image.width, image.height) - 0.5f;
    const bool inside = at.x > -0.5f && at.y > -0.5f && at.x < float(image.width) - 0.5f &&
                        at.y < float(image.height) - 0.5f;  // false if not a number
    if (!inside) throw parts.damaged("a texture coordinate lies outside its page");
    corners[k] = {static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y))};
  }
  const int r = 1 << row.level_max;
  each_lattice_point(row.level_max, [&](int x, int y, std::uint32_t index) {
    const glm::ivec2 texel = (x * corners[0] + y * corners[1] + (r - x - y) * corners[2]) / r;
    const std::uint8_t* const from = &image.rgba[(std::size_t(texel.y) * std::size_t(image.width) + texel.x) * 4];
    std::uint8_t* const to = &model.lattice[(std::size_t(row.lattice_offset) + index) * kChannels];
    std::fill(to, to + kChannels, std::uint8_t(0));  // the MLP's share is 0
    std::copy(from, from + 3, to);
    to[kChannels - 1] = from[3];
  });
}

void take_colours(const ModelParts& parts, Model& model) {
  const json& primitives = parts.glb.document.at("meshes").at(0).at("primitives");
  std::uint64_t texels = std::uint64_t(kAtlasSide) * kAtlasSide;
  for (const TextureEntry& row : model.textures) {
    const glm::ivec2 block = atlas_block(row.level_max);
    texels += 2 * std::uint64_t(block.x) * std::uint64_t(block.y);
  }
  std::vector<bool> taken(model.triangles(), false);
  for (const json& primitive : primitives) {
    const Image image = texture_of(parts, primitive, texels);
    texels -= std::uint64_t(image.width) * std::uint64_t(image.height);
    const std::vector<float> uv = values_of<float>(parts, primitive.at("attributes").at("TEXCOORD_0"), 2);
    if (uv.size() != 6 * model.triangles()) throw parts.damaged("its number of texture coordinates is not valid");
    std::vector<std::uint32_t> indices;
    if (primitive.contains("indices")) indices = values_of<std::uint32_t>(parts, primitive["indices"], 1);
    const std::size_t count = primitive.contains("indices") ? indices.size() / 3 : model.triangles();
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t t = indices.empty() ? i : indices[3 * i] / 3;
      if (t >= model.triangles() || taken[t]) throw parts.damaged("an index of its mesh is not valid");
      taken[t] = true;
      take_texels(parts, image, &uv[6 * t], t, model);
    }
  }
  if (std::find(taken.begin(), taken.end(), false) != taken.end())
    throw parts.damaged("its mesh lacks some of its triangles");
}

}  // namespace

bool has_plain_colours(std::span<const std::byte> bytes, const std::string& name) {
  return decode_glb(bytes, name).document.contains("images");
}

std::optional<Model> read_plain_colours(std::span<const std::byte> bytes, const std::string& name) {
  Model model = decode_model(bytes, name).model;
  const Glb glb = decode_glb(bytes, name);
  if (!has_plain_colours(bytes, name)) return std::nullopt;
  try {
    take_colours({glb, name}, model);
  } catch (const json::exception& e) {
    throw Error("{}: the JSON of its mesh is not that of a trisoup model ({}); export it again", name,
                printable(e.what()));
  }
  return model;
}

}  // namespace trisoup::soup
