#include "soup/model_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "atomic_file.h"
#include "error.h"
#include "scene/image_file.h"
#include "scene/read_file.h"
#include "soup/atlas.h"
#include "soup/bake.h"
#include "soup/texture_table.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;
using scene::Image;

constexpr const char* kExtension = "TRISOUP_neural_textures";
constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;

/// The binary chunk while it grows, and its bufferViews.
struct Binary {
  std::string bytes;
  json views = json::array();

  int add(const void* data, std::size_t size, int target = 0) {
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    bytes.append(static_cast<const char*>(data), size);
    views.push_back(view);
    return static_cast<int>(views.size()) - 1;
  }
};

/// Pages of RGBA texels filled from per-sample values.
class Pages {
 public:
  explicit Pages(const Atlas& atlas) : atlas_(atlas) {
    for (const glm::ivec2& size : atlas.pages) {
      Image image{size.x, size.y, {}};
      image.rgba.resize(static_cast<std::size_t>(size.x) * size.y * 4, 0);
      images_.push_back(std::move(image));
    }
  }
  /// value(sample, channel): 0..255
  template <typename F>
  void fill(const std::vector<TextureEntry>& table, F&& value) {
    for (std::size_t t = 0; t < table.size(); ++t) {
      const AtlasPlace& place = atlas_.places[t];
      const int r = 1 << place.level;
      for (int y = 0; y <= r; ++y)
        for (int x = 0; x + y <= r; ++x) {
          const std::uint32_t n = x + y, sample = table[t].lattice_offset + n * (n + 1) / 2 + y;
          std::uint8_t* texel = at(place, x, y);
          for (int c = 0; c < 4; ++c) texel[c] = value(sample, c);
        }
      each_gutter_texel(place.level, [&](int x, int y, int sx, int sy) { std::memcpy(at(place, x, y), at(place, sx, sy), 4); });
    }
  }
  std::uint8_t* at(const AtlasPlace& place, int x, int y) {
    const glm::ivec2 texel = atlas_texel(place, x, y);
    Image& image = images_[place.page];
    return &image.rgba[(static_cast<std::size_t>(texel.y) * image.width + texel.x) * 4];
  }
  const std::vector<Image>& images() const { return images_; }

 private:
  const Atlas& atlas_;
  std::vector<Image> images_;
};

std::uint32_t level_of(const TextureEntry& row) { return row.level_max; }

/// Row-major 3x3 that turns `up` to +Y, as a glTF node matrix (column-major 4x4).
json up_matrix(const glm::dvec3& up) {
  const glm::dvec3 y = glm::normalize(up);
  const glm::dvec3 helper = std::abs(y.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 z = glm::normalize(glm::cross(helper, y)), x = glm::cross(y, z);
  return {x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, 0, 0, 0, 1};
}

void put_u32(std::vector<std::byte>& out, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::byte>(value >> shift));
}

}  // namespace

std::vector<std::byte> encode_model(const Model& model, const ModelFileOptions& options) {
  if (model.triangles() == 0) throw Error("model: has no triangles; nothing is written");
  std::vector<std::uint32_t> levels;
  for (const TextureEntry& row : model.textures) levels.push_back(level_of(row));
  const Atlas atlas = make_atlas(levels);

  Binary binary;
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "trisoup"}};
  gltf["extensionsUsed"] = {"KHR_materials_unlit", kExtension};
  gltf["scene"] = 0;
  json node = {{"mesh", 0}, {"name", "soup"}};
  if (options.up) node["matrix"] = up_matrix(*options.up);
  gltf["nodes"] = {node};
  gltf["scenes"] = json::array({json{{"nodes", {0}}}});

  glm::vec3 low(INFINITY), high(-INFINITY);
  for (const glm::vec3& v : model.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  const std::size_t vertices = model.vertices.size();
  std::vector<glm::vec2> uv(vertices);
  for (std::size_t t = 0; t < model.triangles(); ++t)
    atlas_uv(atlas.places[t], atlas.pages[atlas.places[t].page], &uv[3 * t]);
  const int position_view = binary.add(model.vertices.data(), vertices * 12, kArrayBuffer);
  const int uv_view = binary.add(uv.data(), vertices * 8, kArrayBuffer);
  json accessors = json::array();
  accessors.push_back({{"bufferView", position_view}, {"componentType", kFloat}, {"count", vertices}, {"type", "VEC3"},
                       {"min", {low.x, low.y, low.z}}, {"max", {high.x, high.y, high.z}}});
  accessors.push_back({{"bufferView", uv_view}, {"componentType", kFloat}, {"count", vertices}, {"type", "VEC2"}});

  // Pictures: the baked colour that every viewer shows, then the features.
  const std::vector<std::uint8_t> baked = bake_colours(model, options.bake_directions);
  const auto lattice = [&](std::uint32_t sample, int c) { return model.lattice[std::size_t(sample) * kChannels + c]; };
  Pages colour(atlas), features_low(atlas), features_high(atlas);
  colour.fill(model.textures, [&](std::uint32_t s, int c) { return c < 3 ? baked[std::size_t(s) * 3 + c] : lattice(s, 7); });
  features_low.fill(model.textures, [&](std::uint32_t s, int c) { return lattice(s, c); });
  features_high.fill(model.textures, [&](std::uint32_t s, int c) { return lattice(s, 4 + c); });

  json images = json::array(), textures = json::array(), materials = json::array(), primitives = json::array(),
       extension_pages = json::array();
  const auto add_image = [&](const Image& image, const std::string& name) {
    const std::string png = scene::encode_png(image, "model");
    images.push_back({{"bufferView", binary.add(png.data(), png.size())}, {"mimeType", "image/png"}, {"name", name}});
    return static_cast<int>(images.size()) - 1;
  };
  for (std::size_t page = 0; page < atlas.pages.size(); ++page) {
    const int image = add_image(colour.images()[page], "colour");
    textures.push_back({{"sampler", 0}, {"source", image}});
    materials.push_back({{"name", "soup"},
                         {"alphaMode", "MASK"},
                         {"alphaCutoff", 0.5},
                         {"doubleSided", true},
                         {"extensions", {{"KHR_materials_unlit", json::object()}}},
                         {"pbrMetallicRoughness",
                          {{"baseColorTexture", {{"index", textures.size() - 1}}}, {"metallicFactor", 0}, {"roughnessFactor", 1}}}});
    json primitive = {{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"material", page}, {"mode", 4}};
    if (atlas.pages.size() > 1) {
      std::vector<std::uint32_t> indices;
      for (std::uint32_t t = 0; t < model.triangles(); ++t)
        if (atlas.places[t].page == page) indices.insert(indices.end(), {3 * t, 3 * t + 1, 3 * t + 2});
      accessors.push_back({{"bufferView", binary.add(indices.data(), indices.size() * 4, kElementArrayBuffer)},
                           {"componentType", kUnsignedInt}, {"count", indices.size()}, {"type", "SCALAR"}});
      primitive["indices"] = accessors.size() - 1;
    }
    primitives.push_back(primitive);
    const int low_image = add_image(features_low.images()[page], "features 0-3");
    const int high_image = add_image(features_high.images()[page], "features 4-6, opacity");
    extension_pages.push_back({{"features", {low_image, high_image}}});
  }
  gltf["meshes"] = json::array({json{{"name", "soup"}, {"primitives", primitives}}});
  gltf["materials"] = materials;
  gltf["textures"] = textures;
  // Bilinear between the samples of one triangle; no mipmaps, which would mix triangles.
  gltf["samplers"] = json::array({json{{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}}});
  gltf["images"] = images;

  static_assert(sizeof(AtlasPlace) == 8);
  json extension;
  extension["version"] = 1;
  extension["triangles"] = model.triangles();
  extension["places"] = binary.add(atlas.places.data(), atlas.places.size() * sizeof(AtlasPlace));
  extension["mlp"] = binary.add(model.mlp.parameters.data(), model.mlp.parameters.size() * 4);
  extension["pages"] = extension_pages;
  extension["sphericalHarmonicsDegree"] = 2;
  extension["background"] = {model.background.r, model.background.g, model.background.b};
  extension["centre"] = {model.centre.x, model.centre.y, model.centre.z};
  extension["scale"] = model.scale;
  extension["settings"] = options.settings;
  gltf["extensions"] = {{kExtension, extension}};

  binary.bytes.resize((binary.bytes.size() + 3) / 4 * 4, '\0');
  gltf["accessors"] = accessors;
  gltf["bufferViews"] = binary.views;
  gltf["buffers"] = json::array({json{{"byteLength", binary.bytes.size()}}});

  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + 8 + binary.bytes.size();
  if (total > 0xffffffffull) throw Error("model: {} bytes are more than a .glb can hold; use fewer triangles", total);
  std::vector<std::byte> out;
  out.reserve(total);
  const auto append = [&](const std::string& s) {
    const auto bytes = std::as_bytes(std::span(s));
    out.insert(out.end(), bytes.begin(), bytes.end());
  };
  for (const std::uint32_t word : {kMagic, 2u, static_cast<std::uint32_t>(total), static_cast<std::uint32_t>(text.size()), kJsonChunk})
    put_u32(out, word);
  append(text);
  put_u32(out, static_cast<std::uint32_t>(binary.bytes.size()));
  put_u32(out, kBinChunk);
  append(binary.bytes);
  return out;
}

ModelFile decode_model(std::span<const std::byte> bytes, const std::string& name) {
  const auto damaged = [&](const char* what) {
    return Error("{}: {}; the file is cut or damaged, export or copy it again", name, what);
  };
  const auto u32 = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 > bytes.size()) throw damaged("ends within its header");
    for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<std::uint32_t>(bytes[at + i]);
    return value;
  };
  if (bytes.size() < 4 || u32(0) != kMagic) throw Error("{}: is not a binary glTF file; give a model.glb", name);
  if (u32(4) != 2 || u32(8) != bytes.size()) throw damaged("does not have the length it states");
  const std::size_t text_size = u32(12);
  if (u32(16) != kJsonChunk || text_size > bytes.size() - 20) throw damaged("has no whole JSON chunk");
  const char* text = reinterpret_cast<const char*>(bytes.data()) + 20;
  const std::size_t bin_at = 20 + text_size;
  const std::size_t bin_size = u32(bin_at);
  if (u32(bin_at + 4) != kBinChunk || bin_size > bytes.size() - bin_at - 8) throw damaged("has no whole binary chunk");
  const std::span<const std::byte> bin = bytes.subspan(bin_at + 8, bin_size);

  ModelFile file;
  Model& model = file.model;
  try {
    const json gltf = json::parse(text, text + text_size);
    if (!gltf.contains("extensions") || !gltf["extensions"].contains(kExtension))
      throw Error("{}: has no {} extension; it is not a trisoup model", name, kExtension);
    const json& extension = gltf["extensions"][kExtension];
    if (extension.at("version").get<int>() != 1)
      throw Error("{}: is of version {}, this program reads version 1; use a newer one", name, extension["version"].dump());
    const auto view = [&](std::size_t index) {
      const json& v = gltf.at("bufferViews").at(index);
      const std::size_t offset = v.value("byteOffset", std::size_t(0)), length = v.at("byteLength").get<std::size_t>();
      if (offset > bin.size() || length > bin.size() - offset) throw damaged("has a bufferView beyond its end");
      return bin.subspan(offset, length);
    };
    const std::size_t triangles = extension.at("triangles").get<std::size_t>();

    const json& positions = gltf.at("accessors").at(gltf.at("meshes").at(0).at("primitives").at(0).at("attributes").at("POSITION").get<std::size_t>());
    const auto position_bytes = view(positions.at("bufferView").get<std::size_t>());
    if (triangles == 0 || triangles > position_bytes.size() / 36 || position_bytes.size() != triangles * 36)
      throw damaged("has another number of vertices than triangles need");
    model.vertices.resize(3 * triangles);
    std::memcpy(model.vertices.data(), position_bytes.data(), position_bytes.size());
    for (const glm::vec3& v : model.vertices)
      if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) throw damaged("has a vertex that is no number");

    const auto place_bytes = view(extension.at("places").get<std::size_t>());
    if (place_bytes.size() != triangles * sizeof(AtlasPlace)) throw damaged("has a texture table of another length");
    std::vector<AtlasPlace> places(triangles);
    std::memcpy(places.data(), place_bytes.data(), place_bytes.size());

    const auto mlp_bytes = view(extension.at("mlp").get<std::size_t>());
    if (mlp_bytes.size() != Mlp::kParameters * 4) throw damaged("has an MLP of another size");
    std::memcpy(model.mlp.parameters.data(), mlp_bytes.data(), mlp_bytes.size());

    std::vector<std::array<Image, 2>> pages;
    for (const json& page : extension.at("pages")) {
      auto& images = pages.emplace_back();
      for (int i = 0; i < 2; ++i) {
        const json& image = gltf.at("images").at(page.at("features").at(i).get<std::size_t>());
        images[i] = scene::decode_image(view(image.at("bufferView").get<std::size_t>()), name + " (texture)");
      }
      if (images[0].width != images[1].width || images[0].height != images[1].height) throw damaged("has pages of unequal size");
    }

    std::vector<TextureLevels> levels;
    for (const AtlasPlace& place : places) {
      if (place.level > kMaxLevel || place.page >= pages.size() || place.turned > 1) throw damaged("has an impossible texture table");
      const int r = 1 << place.level;
      const glm::ivec2 a = atlas_texel(place, 0, 0), b = atlas_texel(place, r, r);
      const Image& image = pages[place.page][0];
      if (std::min(a.x, b.x) < 0 || std::min(a.y, b.y) < 0 || std::max(a.x, b.x) >= image.width || std::max(a.y, b.y) >= image.height)
        throw damaged("has a texture outside its page");
      levels.push_back({place.level, place.level});
    }
    const TextureTable table = make_texture_table(levels);
    model.textures = table.entries;
    for (TextureEntry& row : model.textures) row.source_offset = row.level_min = 0;
    model.lattice.resize(table.lattice_samples * kChannels);
    for (std::size_t t = 0; t < triangles; ++t) {
      const AtlasPlace& place = places[t];
      const int r = 1 << place.level;
      for (int y = 0; y <= r; ++y)
        for (int x = 0; x + y <= r; ++x) {
          const glm::ivec2 texel = atlas_texel(place, x, y);
          const std::uint32_t n = x + y;
          std::uint8_t* to = &model.lattice[(std::size_t(model.textures[t].lattice_offset) + n * (n + 1) / 2 + y) * kChannels];
          for (int i = 0; i < 2; ++i) {
            const Image& image = pages[place.page][i];
            std::memcpy(to + 4 * i, &image.rgba[(static_cast<std::size_t>(texel.y) * image.width + texel.x) * 4], 4);
          }
        }
    }
    const auto vector = [&](const char* key) {
      const json& v = extension.at(key);
      return glm::dvec3(v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>());
    };
    model.background = glm::vec3(vector("background"));
    model.centre = vector("centre");
    model.scale = extension.at("scale").get<double>();
    file.settings = extension.value("settings", json());
  } catch (const json::exception& e) {
    std::string what = e.what();
    std::replace(what.begin(), what.end(), '\n', ' ');
    throw Error("{}: its JSON is not that of a trisoup model ({}); export it again", name, what);
  }
  return file;
}

std::uint64_t write_model(const std::filesystem::path& path, const Model& model, const ModelFileOptions& options) {
  const std::vector<std::byte> bytes = encode_model(model, options);
  write_file_atomically(path, bytes);
  return bytes.size();
}

ModelFile read_model(const std::filesystem::path& path) {
  const std::string content = scene::read_file(path);
  return decode_model(std::as_bytes(std::span(content)), path.string());
}

}  // namespace trisoup::soup
