#include "format/model_file.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "common/host.h"
#include "format/atlas_textures.h"
#include "format/glb.h"
#include "format/lattice_code.h"
#include "format/model_cameras.h"
#include "format/model_parts.h"
#include "format/vertex_grid.h"
#include "image/image_file.h"
#include "image/palette.h"
#include "soup/bake.h"
#include "soup/texture_table.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;

// File versions: with coded vertices, and with a glTF mesh that every viewer reads.
constexpr std::size_t kVersion = 4, kVersionOfMeshes = 3;
// glTF constants for component types and buffer targets.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;

bool finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

std::uint32_t level_of(const TextureEntry& row) { return row.level_max; }

/// Beyond these limits floats cannot represent the soup.
bool has_usable_space(const Model& model) {
  return glm::length(model.centre) < 1e12 && glm::length(model.origin) < 1e12 && model.scale > 1e-9 &&
         model.scale < 1e9;
}

/// Throws Error if the model could not be read back after writing.
void check(const Model& model) {
  if (model.triangles() == 0) throw Error("model: no triangles, so nothing is written; train it again");
  if (model.vertices.size() != 3 * model.triangles())
    throw Error("model: {} triangles have {} vertices; use three per triangle", model.triangles(),
                model.vertices.size());
  for (std::size_t t = 0; t < model.triangles(); ++t) {
    const TextureEntry& row = model.textures[t];
    if (level_of(row) > static_cast<std::uint32_t>(kMaxLevel) ||
        (std::size_t(row.lattice_offset) + samples_at(level_of(row))) * kChannels > model.lattice.size())
      throw Error("model: the texture of triangle {} lies outside the lattice; lay the table out again", t);
  }
  if (model.mlp.parameters.size() != Mlp::kParameters)
    throw Error("model: the MLP has {} parameters instead of {}; set the weights of all layers",
                model.mlp.parameters.size(), Mlp::kParameters);
  const bool numbers =
      std::all_of(model.vertices.begin(), model.vertices.end(), [](const glm::vec3& v) { return finite(v); }) &&
      std::all_of(model.mlp.parameters.begin(), model.mlp.parameters.end(), [](float w) { return std::isfinite(w); }) &&
      finite(model.background) && finite(model.centre) && finite(model.origin) && std::isfinite(model.scale) &&
      model.scale > 0;
  if (!numbers) throw Error("model: some values are not finite; training diverged, lower the learning rates");
  if (!has_usable_space(model))
    throw Error(
        "model: its centre is {:g} from the origin and its scale {:g}, which a model cannot store; move or scale the "
        "dataset, or remove a camera that is far away from all others",
        glm::length(model.centre), model.scale);
}

/// The binary chunk under construction and its bufferViews.
struct Binary {
  std::vector<std::byte> bytes;
  json views = json::array();

  int add(const void* data, std::size_t size, int target = 0) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}};
    if (target != 0) view["target"] = target;
    const auto* begin = static_cast<const std::byte*>(data);
    bytes.insert(bytes.end(), begin, begin + size);
    views.push_back(view);
    return static_cast<int>(views.size()) - 1;
  }
};

/// RGBA atlas pages filled from per-sample values.
class Pages {
 public:
  explicit Pages(const Atlas& atlas) : atlas_(atlas) {
    for (const glm::ivec2& size : atlas.pages) {
      Image image{size.x, size.y, {}};
      image.rgba.resize(static_cast<std::size_t>(size.x) * size.y * 4, 0);
      images_.push_back(std::move(image));
    }
  }
  /// value(sample, channel): 0..255.
  template <typename F>
  void fill(const std::vector<TextureEntry>& table, F&& value) {
    for (std::size_t t = 0; t < table.size(); ++t) {
      const AtlasPlace& place = atlas_.places[t];
      each_lattice_point(place.level, [&](int x, int y, std::uint32_t index) {
        std::uint8_t* texel = at(place, {x, y});
        for (int c = 0; c < 4; ++c) texel[c] = value(table[t].lattice_offset + index, c);
      });
      each_gutter_texel(place.level, [&](const GutterTexel& gutter) {
        const std::uint8_t *a = at(place, gutter.a), *b = at(place, gutter.b), *d = at(place, gutter.c);
        std::uint8_t* texel = at(place, gutter.at);
        for (int c = 0; c < 4; ++c) texel[c] = static_cast<std::uint8_t>(std::clamp(a[c] + b[c] - d[c], 0, 255));
      });
    }
  }
  const std::vector<Image>& images() const { return images_; }
  /// Returns which texels of a page belong to a lattice or its gutter.
  std::vector<bool> used(std::size_t page) {
    const Image& image = images_[page];
    std::vector<bool> is(image.rgba.size() / 4, false);
    const auto use = [&](const AtlasPlace& place, const glm::ivec2& point) {
      const glm::ivec2 texel = atlas_texel(place, point.x, point.y);
      is[static_cast<std::size_t>(texel.y) * image.width + texel.x] = true;
    };
    for (const AtlasPlace& place : atlas_.places) {
      if (place.page != page) continue;
      each_lattice_point(place.level, [&](int x, int y, std::uint32_t) { use(place, {x, y}); });
      each_gutter_texel(place.level, [&](const GutterTexel& gutter) { use(place, gutter.at); });
    }
    return is;
  }

 private:
  std::uint8_t* at(const AtlasPlace& place, const glm::ivec2& point) {
    const glm::ivec2 texel = atlas_texel(place, point.x, point.y);
    Image& image = images_[place.page];
    return &image.rgba[(static_cast<std::size_t>(texel.y) * image.width + texel.x) * 4];
  }

  const Atlas& atlas_;
  std::vector<Image> images_;
};

/// Returns the glTF node matrix (4x4, column-major) that translates by `origin` and then rotates `up` to +Y.
json node_matrix(const glm::dvec3& up, const glm::dvec3& origin) {
  if (!finite(up) || glm::length(up) < 1e-12)
    throw Error("model: its up direction has zero length; use a unit vector or none");
  const glm::dvec3 y = glm::normalize(up);
  const glm::dvec3 helper = std::abs(y.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 z = glm::normalize(glm::cross(helper, y)), x = glm::cross(y, z);
  const glm::dvec3 place(glm::dot(x, origin), glm::dot(y, origin), glm::dot(z, origin));
  return {x.x, y.x, z.x, 0, x.y, y.y, z.y, 0, x.z, y.z, z.z, 0, place.x, place.y, place.z, 1};
}

std::uint32_t checksum(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(
      crc32(crc32(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// Stores a coded part with the checksum that readers verify.
json coded_json(const std::vector<std::byte>& bytes, Binary& binary) {
  return {{"bufferView", binary.add(bytes.data(), bytes.size())}, {"crc32", checksum(bytes)}};
}

std::span<const std::byte> read_coded(const ModelParts& parts, const json& coded, const char* damage) {
  const std::span<const std::byte> bytes = parts.view(coded.at("bufferView"));
  if (checksum(bytes) != parts.whole(coded.at("crc32"))) throw parts.damaged(damage);
  return bytes;
}

/// Reads the vertices of the plain glTF mesh.
std::vector<glm::vec3> read_positions(const ModelParts& parts, std::size_t triangles) {
  const json& gltf = parts.glb.document;
  const json& positions =
      gltf.at("accessors")
          .at(parts.whole(gltf.at("meshes").at(0).at("primitives").at(0).at("attributes").at("POSITION")));
  const std::span<const std::byte> bytes = parts.view(positions.at("bufferView"));
  // Divisions cannot overflow; the file may contain any number.
  constexpr std::size_t triangle_bytes = 3 * sizeof(glm::vec3);
  if (triangles == 0 || bytes.size() % triangle_bytes != 0 || bytes.size() / triangle_bytes != triangles)
    throw parts.damaged("its number of vertices does not match its triangles");
  std::vector<glm::vec3> vertices(3 * triangles);
  std::memcpy(vertices.data(), bytes.data(), bytes.size());
  return vertices;
}

/// Reads the textures and returns their steps.
TextureSteps read_textures(const ModelParts& parts, const json& textures, std::size_t triangles, Model& model) {
  const std::span<const std::byte> bytes = read_coded(parts, textures, "its textures are damaged");
  TextureSteps steps;
  const json& rows = textures.at("steps");
  if (!rows.is_array() || rows.size() != steps.size()) throw parts.damaged("its number of texture steps is not valid");
  for (std::size_t c = 0; c < steps.size(); ++c) {
    const std::size_t step = parts.whole(rows[c]);
    if (step < 1 || step > kMostStep) throw parts.damaged("a texture step is not valid");
    steps[c] = static_cast<std::uint8_t>(step);
  }
  Lattices lattices = decode_lattices(bytes, triangles, steps, parts.name);
  std::vector<TextureLevels> levels;
  for (const std::uint32_t level : lattices.levels) levels.push_back({level, level});
  model.textures = make_texture_table(levels).entries;
  for (TextureEntry& row : model.textures) row.source_offset = row.level_min = 0;
  model.lattice = std::move(lattices.values);
  return steps;
}

glm::dvec3 read_vector(const json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

/// Reads centre, scale and origin. Coded vertices need them.
void read_space(const ModelParts& parts, const json& extension, Model& model) {
  model.centre = read_vector(extension.at("centre"));
  model.scale = extension.at("scale").get<double>();
  if (extension.contains("origin")) model.origin = read_vector(extension["origin"]);
  if (!has_usable_space(model)) throw parts.damaged("its centre or scale is not valid");
}

/// Reads the vertices. read_space() must have been called before.
std::vector<glm::vec3> read_vertices(const ModelParts& parts, const json& extension, std::size_t version,
                                     std::size_t triangles, const Model& model) {
  std::vector<glm::vec3> vertices;
  if (version >= kVersion && extension.contains("vertices"))
    vertices = from_grid(
        decode_vertices(read_coded(parts, extension["vertices"], "its vertices are damaged"), triangles, parts.name),
        model);
  else
    vertices = read_positions(parts, triangles);
  if (vertices.empty()) throw parts.damaged("it has no triangles");
  for (const glm::vec3& v : vertices)
    if (!finite(v)) throw parts.damaged("a vertex is not finite");
  return vertices;
}

Mlp read_mlp(const ModelParts& parts, const json& index) {
  const std::span<const std::byte> bytes = parts.view(index);
  if (bytes.size() != Mlp::kParameters * sizeof(float)) throw parts.damaged("its MLP has the wrong size");
  Mlp mlp;
  std::memcpy(mlp.parameters.data(), bytes.data(), bytes.size());
  for (const float w : mlp.parameters)
    if (!std::isfinite(w)) throw parts.damaged("an MLP weight is not finite");
  return mlp;
}

glm::vec3 read_background(const ModelParts& parts, const json& values) {
  const glm::vec3 background(read_vector(values));
  for (int c = 0; c < 3; ++c)
    if (!(background[c] >= 0.0f && background[c] <= 1.0f)) throw parts.damaged("its background is not a colour");
  return background;
}

bool is_moved(const Model& model) { return model.origin != glm::dvec3(0.0); }

bool codes_vertices(const ModelFileOptions& options) {
  return options.vertex_share > 0 && !options.plain_colours && !options.cameras.empty();
}

json node_json(const Model& model, const ModelFileOptions& options) {
  json node = {{"name", "soup"}};
  if (codes_vertices(options))
    node["extensions"] = {{kExtension, json::object()}};
  else
    node["mesh"] = 0;
  if (const auto& up = options.up ? options.up : options.shown_up)
    node["matrix"] = node_matrix(*up, model.origin);
  else if (is_moved(model))
    node["translation"] = {model.origin.x, model.origin.y, model.origin.z};
  return node;
}

/// Material for other viewers: unlit baked colours, with cut-out transparency.
json material_json(std::size_t texture) {
  return {{"name", "soup"},
          {"alphaMode", "MASK"},
          {"alphaCutoff", 0.5},
          {"doubleSided", true},
          {"extensions", {{"KHR_materials_unlit", json::object()}}},
          {"pbrMetallicRoughness",
           {{"baseColorTexture", {{"index", texture}}}, {"metallicFactor", 0}, {"roughnessFactor", 1}}}};
}

/// The extension's content (docs/formats.md).
json extension_json(const Model& model, const ModelFileOptions& options, Binary& binary) {
  json extension;
  extension["version"] = codes_vertices(options) ? kVersion : kVersionOfMeshes;
  extension["triangles"] = model.triangles();
  if (codes_vertices(options))
    extension["vertices"] = coded_json(encode_vertices(on_grid(model, options.cameras, options.vertex_share)), binary);
  extension["textures"] = coded_json(encode_lattices(model.lattice, model.textures, options.texture_steps), binary);
  extension["textures"]["steps"] = options.texture_steps;
  extension["mlp"] = binary.add(model.mlp.parameters.data(), model.mlp.parameters.size() * 4);
  extension["sphericalHarmonicsDegree"] = 2;
  extension["background"] = {model.background.r, model.background.g, model.background.b};
  extension["centre"] = {model.centre.x, model.centre.y, model.centre.z};
  extension["scale"] = model.scale;
  if (is_moved(model)) extension["origin"] = {model.origin.x, model.origin.y, model.origin.z};
  extension["settings"] = options.settings;
  if (options.up) extension["up"] = {options.up->x, options.up->y, options.up->z};
  if (!options.cameras.empty()) {
    const CodedCameras cameras = code_cameras(options.cameras);
    extension["cameras"] = cameras.json;
    extension["cameras"]["poses"] = binary.add(cameras.poses.data(), cameras.poses.size() * sizeof(float));
    if (const std::vector<float> gains = code_exposures(options.cameras, model.exposures); !gains.empty())
      extension["cameras"]["exposures"] = binary.add(gains.data(), gains.size() * sizeof(float));
  }
  return extension;
}

/// Adds the corners of the triangles. Their accessor must be the first.
void add_positions(const Model& model, Binary& binary, json& accessors) {
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (const glm::vec3& v : model.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  accessors.push_back({{"bufferView", binary.add(model.vertices.data(), model.vertices.size() * 12, kArrayBuffer)},
                       {"componentType", kFloat},
                       {"count", model.vertices.size()},
                       {"type", "VEC3"},
                       {"min", {low.x, low.y, low.z}},
                       {"max", {high.x, high.y, high.z}}});
}

/// Adds texture coordinates into the pages of plain colours. They are floats because Godot 3 reads normalised shorts as
/// pixels.
void add_texture_coordinates(const Model& model, const Atlas& atlas, Binary& binary, json& accessors) {
  std::vector<glm::vec2> uv(model.vertices.size());
  for (std::size_t t = 0; t < model.triangles(); ++t)
    atlas_uv(atlas.places[t], atlas.pages[atlas.places[t].page], &uv[3 * t]);
  accessors.push_back({{"bufferView", binary.add(uv.data(), uv.size() * 8, kArrayBuffer)},
                       {"componentType", kFloat},
                       {"count", uv.size()},
                       {"type", "VEC2"}});
}

/// Adds the indices of one page's triangles and returns their accessor.
json add_indices(const Atlas& atlas, std::size_t page, Binary& binary, json& accessors) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t t = 0; t < atlas.places.size(); ++t)
    if (atlas.places[t].page == page) indices.insert(indices.end(), {3 * t, 3 * t + 1, 3 * t + 2});
  accessors.push_back({{"bufferView", binary.add(indices.data(), indices.size() * 4, kElementArrayBuffer)},
                       {"componentType", kUnsignedInt},
                       {"count", indices.size()},
                       {"type", "SCALAR"}});
  return accessors.size() - 1;
}

/// Adds what other viewers show: one image of plain colours, one material and one primitive per page. Returns the
/// primitives.
json add_plain_colours(const Model& model, const ModelFileOptions& options, Binary& binary, json& accessors,
                       json& gltf) {
  std::vector<std::uint32_t> levels;
  for (const TextureEntry& row : model.textures) levels.push_back(level_of(row));
  const Atlas atlas = make_atlas(levels, options.atlas_side);
  add_texture_coordinates(model, atlas, binary, accessors);
  const std::vector<std::uint8_t> baked = options.baked.empty() ? bake_colours(model, {}) : options.baked;
  if (baked.size() != model.lattice.size() / kChannels * 3)
    throw Error("model: {} values of baked colours for {} samples; bake them from this model", baked.size(),
                model.lattice.size() / kChannels);
  Pages colour(atlas);
  colour.fill(model.textures, [&](std::uint32_t s, int c) {
    return c < 3 ? baked[std::size_t(s) * 3 + c] : model.lattice[std::size_t(s) * kChannels + 7];
  });
  json primitives = json::array();
  for (const char* list : {"images", "textures", "materials"}) gltf[list] = json::array();
  for (std::size_t page = 0; page < atlas.pages.size(); ++page) {
    const Image& whole = colour.images()[page];
    const std::string png = options.colour_palette ? encode_png(make_palette(whole, colour.used(page)), "model")
                                                   : encode_png(whole, "model");
    gltf["images"].push_back(
        {{"bufferView", binary.add(png.data(), png.size())}, {"mimeType", "image/png"}, {"name", "colour"}});
    gltf["textures"].push_back({{"sampler", 0}, {"source", page}});
    gltf["materials"].push_back(material_json(page));
    json primitive = {{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"material", page}, {"mode", 4}};
    if (atlas.pages.size() > 1) primitive["indices"] = add_indices(atlas, page, binary, accessors);
    primitives.push_back(primitive);
  }
  // Bilinear filtering stays within one triangle. Mipmaps would mix triangles, so there are none.
  gltf["samplers"] = json::array({json{{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}}});
  return primitives;
}

/// Adds the model's only mesh.
void add_mesh(const Model& model, const ModelFileOptions& options, Binary& binary, json& gltf) {
  json accessors = json::array();
  add_positions(model, binary, accessors);
  json primitives = json::array({json{{"attributes", {{"POSITION", 0}}}, {"mode", 4}}});
  if (options.plain_colours) {
    primitives = add_plain_colours(model, options, binary, accessors, gltf);
    gltf["extensionsUsed"].push_back("KHR_materials_unlit");
  }
  gltf["meshes"] = json::array({json{{"name", "soup"}, {"primitives", primitives}}});
  gltf["accessors"] = accessors;
}

}  // namespace

std::vector<std::byte> encode_model(const Model& unsorted, const ModelFileOptions& options) {
  check(unsorted);
  check_cameras(options.cameras);
  const Model sorted = codes_vertices(options) ? along_curve(unsorted) : Model{};
  const Model& model = codes_vertices(options) ? sorted : unsorted;
  Binary binary;
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "trisoup"}};
  gltf["extensionsUsed"] = json::array({kExtension});
  gltf["scene"] = 0;
  // {node} without json::array is an array with GCC and a copy with Clang.
  gltf["nodes"] = json::array({node_json(model, options)});
  gltf["scenes"] = json::array({json{{"nodes", json::array({0})}}});

  if (codes_vertices(options))
    gltf["extensionsRequired"] = gltf["extensionsUsed"];
  else
    add_mesh(model, options, binary, gltf);
  gltf["extensions"] = {{kExtension, extension_json(model, options, binary)}};
  gltf["bufferViews"] = binary.views;
  gltf["buffers"] = json::array({json{{"byteLength", binary.bytes.size()}}});
  return encode_glb(gltf, binary.bytes, "model");
}

ModelFile decode_model(std::span<const std::byte> bytes, const std::string& name) {
  const Glb glb = decode_glb(bytes, name);
  const ModelParts parts{glb, name};
  const json& gltf = glb.document;
  if (!gltf.contains("extensions") || !gltf["extensions"].contains(kExtension))
    throw Error("{}: has no {} extension; it is not a trisoup model", name, kExtension);

  ModelFile file;
  Model& model = file.model;
  try {
    const json& extension = gltf["extensions"][kExtension];
    const std::size_t version = parts.whole(extension.at("version"));
    if (version < 1 || version > kVersion)
      throw Error("{}: file version {} is not supported, only 1 to {}; use a newer trisoup", name, version, kVersion);

    if (extension.at("sphericalHarmonicsDegree") != 2)
      throw Error("{}: spherical harmonics of a degree other than 2 are not supported; use a newer trisoup", name);
    const std::size_t triangles = parts.whole(extension.at("triangles"));
    read_space(parts, extension, model);
    model.vertices = read_vertices(parts, extension, version, triangles, model);
    model.mlp = read_mlp(parts, extension.at("mlp"));
    if (version == 1)
      read_atlas_textures(parts, extension, model);
    else
      file.texture_steps = read_textures(parts, extension.at("textures"), triangles, model);
    model.background = read_background(parts, extension.at("background"));
    file.settings = extension.value("settings", json());
    if (extension.contains("up")) {
      file.up = read_vector(extension["up"]);
      if (const double length = glm::length(*file.up); !(length > 1e-12 && length < 1e12))
        throw parts.damaged("its up direction has zero length");
    }
    if (extension.contains("cameras")) {
      file.cameras = read_cameras(parts, extension["cameras"]);
      model.exposures = read_exposures(parts, extension["cameras"], file.cameras);
    }
  } catch (const json::exception& e) {
    throw Error("{}: its JSON is not that of a trisoup model ({}); export it again", name, printable(e.what()));
  }
  return file;
}

std::uint64_t write_model(const std::filesystem::path& path, const Model& model, const ModelFileOptions& options) {
  const std::vector<std::byte> bytes = encode_model(model, options);
  write_file_atomically(path, bytes);
  return bytes.size();
}

std::filesystem::path model_in(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? path / "model.glb" : path;
}

ModelFile read_model(const std::filesystem::path& path) {
  const std::string content = read_file(path);
  return decode_model(std::as_bytes(std::span(content)), path.string());
}

}  // namespace trisoup::soup
