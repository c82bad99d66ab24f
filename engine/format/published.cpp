#include "format/published.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "common/host.h"
#include "image/image_file.h"
#include "mesh/inner_box.h"
#include "mesh/mesh.h"
#include "soup/atlas.h"
#include "soup/texture_table.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr std::size_t kMaxWidth = 4096;  // of a texture, texels
constexpr const char *kMlp = "mlp_weights.json", *kMeta = "meta.json";
constexpr std::array<const char*, 2> kTextures{"lut0.png", "lut1.png"};
/// Layers of the MLP in the order of Mlp::parameters, with their numbers of values.
constexpr std::array<std::pair<const char*, std::size_t>, 6> kLayers{
    {{"W1", 256}, {"b1", 16}, {"W2", 256}, {"b2", 16}, {"W3", 48}, {"b3", 3}}};

static_assert(std::endian::native == std::endian::little, "the mesh is written in memory order");

void append(std::string& bytes, const void* data, std::size_t size) {
  bytes.append(static_cast<const char*>(data), size);
}

void write(const fs::path& path, const std::string& content) { write_file_atomically(path, bytes_of(content)); }

std::string ply(const Model& model) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      model.vertices.size(), model.triangles());
  for (const glm::vec3& v : model.vertices) {
    const glm::vec3 p(glm::dvec3(v) + model.origin);
    append(text, &p, sizeof p);
  }
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(model.triangles()); ++t) {
    const std::array<std::int32_t, 3> corners{3 * t, 3 * t + 1, 3 * t + 2};
    text.push_back(3);
    append(text, corners.data(), sizeof corners);
  }
  return text;
}

/// Width and height of a texture that holds the samples of all triangles one after the other. The rest of the last row
/// is zero.
glm::ivec2 texture_size(std::size_t samples) {
  const std::size_t width = std::min(kMaxWidth, samples);
  return {static_cast<int>(width), static_cast<int>((samples + width - 1) / width)};
}

json parsed(const fs::path& path) {
  try {
    return json::parse(read_file(path));
  } catch (const json::exception& e) {
    throw Error("{}: not valid JSON ({}); export it again", path.string(), printable(e.what()));
  }
}

/// Returns the names in a list of scenes. Empty if the file does not exist.
std::set<std::string> scenes_in(const fs::path& list) {
  std::error_code ignored;
  if (!fs::exists(list, ignored)) return {};
  try {
    return parsed(list).get<std::set<std::string>>();
  } catch (const json::exception&) {
    throw Error("{}: not a list of scene names; correct or delete it", list.string());
  }
}

glm::dvec3 vector_of(const json& value) {
  return {value.at(0).get<double>(), value.at(1).get<double>(), value.at(2).get<double>()};
}

std::vector<float> mlp_of(const fs::path& path) {
  const json layers = parsed(path);
  std::vector<float> parameters;
  try {
    for (const auto& [name, size] : kLayers) {
      const auto values = layers.at(name).get<std::vector<float>>();
      if (values.size() != size)
        throw Error("{}: {} has {} values instead of {}; export it again", path.string(), name, values.size(), size);
      parameters.insert(parameters.end(), values.begin(), values.end());
    }
  } catch (const json::exception& e) {
    throw Error("{}: is not the MLP of a soup ({}); export it again", path.string(), printable(e.what()));
  }
  return parameters;
}

}  // namespace

Model at_one_level(const Model& model, std::uint32_t level) {
  for (const TextureEntry& row : model.textures)
    if (row.level_max > level || level > static_cast<std::uint32_t>(kMaxLevel))
      throw Error("model: textures of level {} cannot be stored at level {}; use {} to {}", row.level_max, level,
                  row.level_max, kMaxLevel);
  Model result = model;
  result.textures = make_texture_table(model.triangles(), {level, level}).entries;
  result.lattice.assign(std::size_t(samples_at(level)) * model.triangles() * kChannels, 0);
  const float r = static_cast<float>(1u << level);
  for (std::size_t t = 0; t < model.triangles(); ++t) {
    TextureEntry& row = result.textures[t];
    row.source_offset = row.level_min = 0;
    const std::uint8_t* from = &model.lattice[std::size_t(model.textures[t].lattice_offset) * kChannels];
    each_lattice_point(level, [&](int x, int y, std::uint32_t index) {
      const auto cell =
          f32::lattice_cell(static_cast<float>(x) / r, static_cast<float>(y) / r, model.textures[t].level_max);
      std::uint8_t* to = &result.lattice[(std::size_t(row.lattice_offset) + index) * kChannels];
      for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(kChannels); ++c) {
        const auto value = [&](std::uint32_t i) { return static_cast<float>(from[i * kChannels + c]); };
        to[c] = static_cast<std::uint8_t>(
            std::lround(f32::lattice_mix(cell, value(cell.i0), value(cell.i1), value(cell.i2))));
      }
    });
  }
  return result;
}

void write_published(const fs::path& data, const std::string& name, const Model& model, const glm::dvec3& up) {
  std::uint32_t level = 0;
  for (const TextureEntry& row : model.textures) level = std::max(level, row.level_max);
  const Model even = at_one_level(model, level);
  const fs::path folder = data / name;
  std::set<std::string> scenes = scenes_in(data / kPublishedScenes);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be created ({}); choose another folder", folder.string(), error.message());

  for (std::size_t half = 0; half < 2; ++half) {
    const std::size_t samples = even.lattice.size() / kChannels;
    const glm::ivec2 size = texture_size(samples);
    Image image{size.x, size.y, std::vector<std::uint8_t>(4 * std::size_t(size.x) * std::size_t(size.y))};
    for (std::size_t i = 0; i < samples; ++i)
      std::copy_n(&even.lattice[i * kChannels + 4 * half], 4, &image.rgba[4 * i]);
    write_png(folder / kTextures[half], image);
  }
  json mlp, meta;
  std::size_t first = 0;
  for (const auto& [layer, size] : kLayers) {
    mlp[layer] = std::vector<float>(model.mlp.parameters.begin() + static_cast<std::ptrdiff_t>(first),
                                    model.mlp.parameters.begin() + static_cast<std::ptrdiff_t>(first + size));
    first += size;
  }
  meta = {{"up", {up.x, up.y, up.z}},
          {"level", level},
          {"background", {model.background.r, model.background.g, model.background.b}},
          {"num_faces", model.triangles()},
          {"num_verts", model.vertices.size()}};
  write(folder / kMlp, mlp.dump());
  write(folder / kMeta, meta.dump(2) + "\n");
  write(folder / kPublishedMesh, ply(model));
  scenes.insert(utf8(name));
  write(data / kPublishedScenes, json(scenes).dump(2) + "\n");
}

bool is_published(const fs::path& folder) { return is_file(folder / kPublishedMesh) && is_file(folder / kTextures[0]); }

ModelFile read_published(const fs::path& folder) {
  ModelFile file;
  Model& model = file.model;
  // Defaults of the published viewer if the file is missing.
  glm::dvec3 up(0, -1, 0);
  std::int64_t level = 5;
  if (is_file(folder / kMeta)) {
    const json meta = parsed(folder / kMeta);
    try {
      if (meta.contains("up")) up = vector_of(meta["up"]);
      level = meta.value("level", level);
      if (meta.contains("background")) model.background = glm::vec3(vector_of(meta["background"]));
    } catch (const json::exception& e) {
      throw Error("{}: not a valid scene description ({}); export it again", (folder / kMeta).string(),
                  printable(e.what()));
    }
  }
  for (int c = 0; c < 3; ++c)
    if (!(model.background[c] >= 0.0f && model.background[c] <= 1.0f))
      throw Error("{}: its background is not a colour; use three numbers from 0 to 1", (folder / kMeta).string());
  if (level < 0 || level > kMaxLevel)
    throw Error("{}: texture level {} is not supported; export it at level {} or lower", (folder / kMeta).string(),
                level, kMaxLevel);
  if (const double length = glm::length(up); length > 1e-12 && length < 1e12) file.up = up / length;

  const Mesh mesh = read_mesh(folder / kPublishedMesh);
  for (const std::uint32_t index : mesh.indices) model.vertices.push_back(mesh.positions[index]);
  const auto entry = static_cast<std::uint32_t>(level);
  const TextureTable table = make_texture_table(mesh.triangles(), {entry, entry});
  model.textures = table.entries;
  for (TextureEntry& row : model.textures) row.source_offset = row.level_min = 0;
  for (std::size_t half = 0; half < 2; ++half) {
    const fs::path path = folder / kTextures[half];
    const glm::ivec2 expected = texture_size(table.lattice_samples);
    const Image image = read_image(path);
    if (image.width != expected.x || image.height != expected.y)
      throw Error("{}: {} x {} texels, but {} triangles of level {} need {} x {}; export the scene again",
                  path.string(), image.width, image.height, mesh.triangles(), level, expected.x, expected.y);
    // Allocated only after a file of the expected size was read.
    model.lattice.resize(table.lattice_samples * kChannels);
    for (std::size_t i = 0; i < table.lattice_samples; ++i)
      std::copy_n(&image.rgba[4 * i], 4, &model.lattice[i * kChannels + 4 * half]);
  }
  model.mlp.parameters = mlp_of(folder / kMlp);

  const Box box = inner_box(model.vertices, 0.05);
  model.centre = 0.5 * (glm::dvec3(box.low) + glm::dvec3(box.high));
  model.scale = 1.0 / std::max(1e-6, glm::length(glm::dvec3(box.high) - glm::dvec3(box.low)));
  // The scene's cameras are not known. These planes clip nothing.
  file.settings = {{"source", "published"}, {"test_near", 0.01}, {"far", 100.0}, {"drop_near", false}};
  return file;
}

}  // namespace trisoup::soup
