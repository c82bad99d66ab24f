// Tests engine/format/model_file.cpp, glb.cpp and bake.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <set>
#include <tuple>

#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "base/read_file.h"
#include "common/host.h"
#include "format/glb.h"
#include "format/lattice_hierarchy.h"
#include "format/model_bytes.h"
#include "format/model_file.h"
#include "image/image_file.h"
#include "mesh/mesh.h"
#include "npz.h"
#include "shared_data.h"
#include "soup/bake.h"
#include "soup/random.h"
#include "soup/texture_table.h"
#include "temporary_folder.h"

using namespace trisoup;
using Catch::Matchers::Contains;

namespace {

soup::Model random_model(std::size_t triangles, std::uint64_t seed) {
  soup::Random random(seed);
  std::vector<soup::TextureLevels> levels;
  soup::Model model;
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::uint32_t level = random.bits() % (soup::kMaxLevel + 1);
    levels.push_back({level, level});
    for (int k = 0; k < 3; ++k)
      model.vertices.emplace_back(random.uniform01(), random.uniform01() * 1e-3f, random.uniform01() * 1e4f);
  }
  const soup::TextureTable table = soup::make_texture_table(levels);
  model.textures = table.entries;
  for (auto& row : model.textures) row.source_offset = row.level_min = 0;
  for (std::uint64_t i = 0; i < table.lattice_samples * 8; ++i)
    model.lattice.push_back(static_cast<std::uint8_t>(random.bits()));
  for (float& w : model.mlp.parameters) w = random.uniform01() - 0.5f;
  model.background = {0.25f, 0.5f, 1.0f};
  model.centre = {1.0 / 3, -2e5, 1e-9};
  model.scale = 0.1234567890123456789;
  return model;
}

/// Returns the file with its JSON changed by `edit`.
template <typename F>
std::vector<std::byte> edited(const std::vector<std::byte>& bytes, F&& edit) {
  soup::Glb glb = soup::decode_glb(bytes, "memory");
  edit(glb.document);
  return soup::encode_glb(glb.document, glb.binary, "memory");
}

/// A model of three triangles, stored in files of all versions. ending: of the file name.
std::vector<std::byte> three_triangles(const char* ending) {
  const std::string content =
      read_file(TRISOUP_SOURCE_DIR "/tests/fuzz/corpus/model_file/three_triangles" + std::string(ending) + ".glb");
  const auto bytes = std::as_bytes(std::span(content));
  return {bytes.begin(), bytes.end()};
}

/// A PNG page of a version 1 file.
std::vector<std::byte> first_version() { return three_triangles(""); }

nlohmann::json& extension_of(nlohmann::json& document) { return document["extensions"]["TRISOUP_neural_textures"]; }

soup::ModelCamera some_camera(const std::string& name, bool test, std::uint64_t seed) {
  soup::Random random(seed);
  soup::ModelCamera c{name, test, {}};
  c.camera.width = 40;
  c.camera.height = 30;
  c.camera.fx = c.camera.fy = 50.25;
  c.camera.cx = 20.5;
  c.camera.cy = 15.125;
  const glm::dvec3 axis = glm::normalize(glm::dvec3(random.uniform01(), random.uniform01(), random.uniform01()) - 0.5);
  c.camera.world_to_camera = glm::rotate(glm::dmat4(1), 6.3 * random.uniform01(), axis);
  c.camera.world_to_camera[3] = glm::dvec4(random.uniform01(), -random.uniform01(), 1.0 + random.uniform01(), 1);
  return c;
}

/// Returns the bytes of a bufferView.
std::span<const std::byte> view_of(const soup::Glb& glb, std::size_t index) {
  const nlohmann::json& view = glb.document["bufferViews"][index];
  return glb.binary.subspan(view["byteOffset"].get<std::size_t>(), view["byteLength"].get<std::size_t>());
}

bool same(const soup::Model& a, const soup::Model& b) {
  if (a.triangles() != b.triangles() || a.vertices.size() != b.vertices.size() || a.lattice != b.lattice) return false;
  if (std::memcmp(a.vertices.data(), b.vertices.data(), a.vertices.size() * 12) != 0) return false;
  if (std::memcmp(a.textures.data(), b.textures.data(), a.textures.size() * 16) != 0) return false;
  return a.mlp.parameters == b.mlp.parameters && a.background == b.background && a.centre == b.centre &&
         a.scale == b.scale && a.origin == b.origin;
}

}  // namespace

TEST_CASE("baked colours are the mean over directions of the shaded colour", "[bake]") {
  const soup::Model model = random_model(3, 9);
  const std::vector<glm::vec3> directions{{0, 0, 1}, {0.6f, 0, 0.8f}};
  const auto baked = soup::bake_colours(model, directions);
  for (std::size_t s = 0; s < model.lattice.size() / 8; s += 7) {
    glm::dvec3 mean(0);
    for (const glm::vec3& d : directions) {
      std::vector<double> weights(model.mlp.parameters.begin(), model.mlp.parameters.end());
      double x[16], h1[16], h2[16], y[3];
      for (int c = 0; c < 7; ++c) x[c] = model.lattice[s * 8 + c] / 255.0;
      f64::spherical_harmonics(d, x + 7);
      f64::mlp_forward(weights.data(), x, h1, h2, y);
      mean += 0.5 * f64::skip_connection(x, {y[0], y[1], y[2]});
    }
    for (int c = 0; c < 3; ++c) CHECK(std::abs(baked[s * 3 + c] - 255 * mean[c]) <= 0.51);
  }
}

TEST_CASE("a model file is read back unchanged", "[model_file]") {
  for (const std::size_t triangles : {1u, 2u, 97u}) {
    const soup::Model model = random_model(triangles, triangles);
    soup::ModelFileOptions options;
    options.up = glm::dvec3(0, 0, 1);
    options.settings = {{"steps", 5}};
    const auto bytes = soup::encode_model(model, options);
    const soup::ModelFile file = soup::decode_model(bytes, "memory");
    CHECK(same(model, file.model));
    CHECK(file.settings == options.settings);
  }
}

TEST_CASE("a model far from the origin has its position in the root node", "[model_file]") {
  soup::Model model = random_model(2, 5);
  model.origin = {4e5, 5e6, 100.125};
  soup::ModelFileOptions options;
  for (const bool up : {false, true}) {
    if (up) options.up = glm::dvec3(0, 0, 1);
    const auto bytes = soup::encode_model(model, options);
    CHECK(same(model, soup::decode_model(bytes, "memory").model));
    const nlohmann::json node = soup::decode_glb(bytes, "memory").document["nodes"][0];
    if (!up) {
      CHECK(node["translation"] == nlohmann::json({4e5, 5e6, 100.125}));
      continue;
    }
    // The matrix is a rotation R with the translation R origin; +z becomes +Y.
    const auto m = node["matrix"].get<std::vector<double>>();
    CHECK(m[13] == Approx(100.125));
    CHECK(std::hypot(m[12], m[14]) == Approx(std::hypot(4e5, 5e6)));
  }
}

TEST_CASE("without an up direction of the dataset, only the root node turns the model for viewers", "[model_file]") {
  soup::Model model = random_model(2, 5);
  model.origin = {4e3, -5e3, 100.125};
  const glm::dvec3 up = glm::normalize(glm::dvec3(0.2, -0.9, 0.4));
  soup::ModelFileOptions options;
  options.shown_up = up;
  const auto bytes = soup::encode_model(model, options);
  const soup::ModelFile file = soup::decode_model(bytes, "memory");
  CHECK(same(model, file.model));
  CHECK_FALSE(file.up.has_value());
  const auto m = soup::decode_glb(bytes, "memory").document["nodes"][0].at("matrix").get<std::vector<double>>();
  const auto turned = [&](const glm::dvec3& v) {
    return glm::dvec3(m[0] * v.x + m[4] * v.y + m[8] * v.z, m[1] * v.x + m[5] * v.y + m[9] * v.z,
                      m[2] * v.x + m[6] * v.y + m[10] * v.z);
  };
  CHECK(glm::length(turned(up) - glm::dvec3(0, 1, 0)) < 1e-12);
  CHECK(glm::length(turned(model.origin) - glm::dvec3(m[12], m[13], m[14])) < 1e-9);
  // A known up direction takes precedence and is stored in the extension.
  options.up = glm::dvec3(0, 0, 1);
  const auto known = soup::encode_model(model, options);
  CHECK(*soup::decode_model(known, "memory").up == glm::dvec3(0, 0, 1));
  CHECK(soup::decode_glb(known, "memory").document["nodes"][0]["matrix"][9] == 1.0);
}

TEST_CASE("the mesh of a model is in dataset coordinates, whatever the root node does", "[model_file][mesh]") {
  soup::Model model = random_model(20, 5);
  model.origin = {40, -50, 10.125};
  const test::TemporaryFolder folder;
  for (const auto& [up, shown] : {std::pair<bool, bool>{false, false}, {true, false}, {false, true}}) {
    soup::ModelFileOptions options;
    if (up) options.up = glm::dvec3(0, 0, 1);
    if (shown) options.shown_up = glm::dvec3(0.2, -0.9, 0.4);
    soup::write_model(folder / "model.glb", model, options);
    const soup::Mesh mesh = soup::read_mesh(folder / "model.glb");
    REQUIRE(mesh.triangles() == model.triangles());
    double furthest = 0;
    for (std::size_t t = 0; t < model.triangles(); ++t)
      for (int k = 0; k < 3; ++k)
        furthest = std::max(furthest, glm::length(glm::dvec3(mesh.positions[mesh.indices[3 * t + k]]) -
                                                  glm::dvec3(model.vertices[3 * t + k]) - model.origin));
    CHECK(furthest < 1e-4);
  }
}

TEST_CASE("a model of several atlas pages is read back unchanged, with one primitive per page", "[model_file]") {
  const soup::Model model = random_model(2500, 11);
  soup::ModelFileOptions options;
  options.atlas_side = soup::kMinAtlasSide;
  options.baked.assign(model.lattice.size() / soup::kChannels * 3, 0);  // colours do not matter here and take longest
  const auto bytes = soup::encode_model(model, options);
  CHECK(same(model, soup::decode_model(bytes, "memory").model));

  const soup::Glb glb = soup::decode_glb(bytes, "memory");
  const nlohmann::json& primitives = glb.document["meshes"][0]["primitives"];
  REQUIRE(primitives.size() > 1);
  std::vector<int> drawn(model.vertices.size(), 0);
  for (const nlohmann::json& primitive : primitives) {
    const auto indices = view_of(glb, glb.document["accessors"][primitive["indices"].get<std::size_t>()]["bufferView"]);
    for (std::size_t i = 0; i < indices.size(); i += 4) {
      std::uint32_t index = 0;
      std::memcpy(&index, &indices[i], 4);
      REQUIRE(index < drawn.size());
      ++drawn[index];
    }
  }
  CHECK(std::all_of(drawn.begin(), drawn.end(), [](int times) { return times == 1; }));
}

TEST_CASE("bilinear sampling of the base colour agrees with the lattice", "[model_file][atlas]") {
  soup::Model model = random_model(40, 21);
  for (std::uint8_t& value : model.lattice)
    value = static_cast<std::uint8_t>(100 + value % 50);  // avoids saturation in gutters
  const auto bytes = soup::encode_model(model, {});
  const soup::Glb glb = soup::decode_glb(bytes, "memory");
  const Image image = decode_image(view_of(glb, glb.document["images"][0]["bufferView"]), "base colour");
  std::vector<glm::vec2> uv(model.vertices.size());
  std::memcpy(uv.data(), view_of(glb, glb.document["accessors"][1]["bufferView"]).data(),
              uv.size() * sizeof(glm::vec2));

  const auto bilinear = [&](const glm::dvec2& at, int channel) {  // OpenGL LINEAR with CLAMP_TO_EDGE
    const glm::dvec2 texel = at * glm::dvec2(image.width, image.height) - 0.5, corner = glm::floor(texel),
                     f = texel - corner;
    double sum = 0;
    for (int dy = 0; dy < 2; ++dy)
      for (int dx = 0; dx < 2; ++dx) {
        const int x = glm::clamp(int(corner.x) + dx, 0, image.width - 1),
                  y = glm::clamp(int(corner.y) + dy, 0, image.height - 1);
        sum +=
            (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y) * image.rgba[(std::size_t(y) * image.width + x) * 4 + channel];
      }
    return sum;
  };
  soup::Random random(22);
  for (std::size_t t = 0; t < model.triangles(); ++t) {
    const std::uint32_t level = model.textures[t].level_max;
    const double r = 1 << level;
    const auto opacity = [&](std::uint32_t index) {
      return double(model.lattice[(model.textures[t].lattice_offset + index) * 8 + 7]);
    };
    const auto both = [&](double b0, double b1) {
      const glm::dvec2 at =
          b0 * glm::dvec2(uv[3 * t]) + b1 * glm::dvec2(uv[3 * t + 1]) + (1 - b0 - b1) * glm::dvec2(uv[3 * t + 2]);
      const f64::LatticeCell cell = f64::lattice_cell(b0, b1, level);
      const double exact = f64::lattice_mix(cell, opacity(cell.i0), opacity(cell.i1), opacity(cell.i2));
      return std::pair(bilinear(at, 3), exact);
    };
    for (int i = 0; i < 60; ++i) {
      const double s = random.uniform01();
      // The three edges, with a margin for texture coordinates in float.
      for (const glm::dvec2 b : {glm::dvec2(s, 0), glm::dvec2(0, s), glm::dvec2(s, 1 - s)}) {
        const auto [sampled, exact] = both(b.x, b.y);
        CHECK(sampled == Approx(exact).margin(0.05));
      }
      // Lattice points.
      const std::uint32_t x = random.below(std::uint32_t(r) + 1), y = random.below(std::uint32_t(r) + 1 - x);
      const auto [sampled, exact] = both(x / r, y / r);
      CHECK(sampled == Approx(opacity(f64::lattice_index(x, y))).margin(0.05));
      // Inside of the cells along the diagonal.
      if (x + y == r || x == r || y == r) continue;
      const std::uint32_t last = std::uint32_t(r) - 1 - x;
      double u = random.uniform01(), v = random.uniform01();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto [inside, inside_exact] = both((x + u) / r, (last + v) / r);
      CHECK(inside == Approx(inside_exact).margin(0.05));
    }
  }
}

TEST_CASE("the bytes of a model are counted by part", "[model_file][model_bytes]") {
  soup::Model model = random_model(40, 35);
  soup::ModelFileOptions options;
  options.cameras = {some_camera("a", true, 1), some_camera("b", false, 2)};
  const auto bytes = soup::encode_model(model, options);
  const nlohmann::json parts = soup::bytes_by_part(bytes, "x");
  CHECK(parts["vertices"] == 40 * 36);
  CHECK(parts["texture_coordinates"] == 40 * 24);
  CHECK(parts["mlp"] == 595 * 4);
  nlohmann::json document = soup::decode_glb(bytes, "x").document;
  CHECK(parts["cameras"] == extension_of(document)["cameras"].dump().size() + 2 * 28);
  // Values are random, so seven features take seven times the bytes of opacity.
  CHECK(parts["features"].get<double>() == Approx(7 * parts["opacity"].get<double>()).epsilon(0.05));
  std::size_t sum = 0;
  for (const auto& part : parts) sum += part.get<std::size_t>();
  CHECK(sum == bytes.size());
  CHECK_THROWS_WITH(soup::bytes_by_part(first_version(), "x.glb"), Contains("x.glb") && Contains("versions 1 and 2"));
}

TEST_CASE("a model without plain colours is the same in fewer bytes", "[model_file][model_bytes]") {
  const soup::Model model = random_model(40, 36);
  soup::ModelFileOptions options;
  const auto whole = soup::encode_model(model, options);
  options.plain_colours = false;
  const auto bytes = soup::encode_model(model, options);
  CHECK(same(model, soup::decode_model(bytes, "memory").model));
  const auto parts = soup::bytes_by_part(bytes, "x"), all = soup::bytes_by_part(whole, "x");
  for (const char* part : {"texture_coordinates", "plain_colours"}) {
    CHECK(parts[part] == 0);
    CHECK(all[part] > 100);
  }
  for (const char* part : {"vertices", "features", "opacity", "mlp"}) CHECK(parts[part] == all[part]);
  const nlohmann::json document = soup::decode_glb(bytes, "memory").document;
  for (const char* list : {"images", "textures", "materials", "samplers"}) CHECK(!document.contains(list));
  CHECK(document["extensionsUsed"] == nlohmann::json({"TRISOUP_neural_textures"}));
}

TEST_CASE("programs that know glTF alone find all they need", "[model_file]") {
  // Several pages. Godot, glTFast and Unreal take cut-outs, both sides and unlit colours from the material; an unknown
  // extension must not be required, and mipmaps would mix triangles.
  soup::ModelFileOptions options;
  options.atlas_side = soup::kMinAtlasSide;
  const soup::Model model = random_model(2500, 11);
  options.baked.assign(model.lattice.size() / soup::kChannels * 3, 0);
  const std::vector<std::byte> bytes = soup::encode_model(model, options);
  const soup::Glb glb = soup::decode_glb(bytes, "memory");
  const nlohmann::json& document = glb.document;
  CHECK_FALSE(document.contains("extensionsRequired"));
  const nlohmann::json& used = document["extensionsUsed"];
  CHECK(std::count(used.begin(), used.end(), "KHR_materials_unlit") == 1);
  REQUIRE(document["materials"].size() > 1);
  for (const nlohmann::json& material : document["materials"]) {
    CHECK(material["doubleSided"] == true);
    CHECK(material["alphaMode"] == "MASK");
    CHECK(material["alphaCutoff"] == 0.5);
    CHECK(material["extensions"].contains("KHR_materials_unlit"));
    CHECK_FALSE(material["pbrMetallicRoughness"].contains("baseColorFactor"));  // white
    CHECK_FALSE(material["pbrMetallicRoughness"]["baseColorTexture"].contains("texCoord"));
  }
  for (const nlohmann::json& texture : document["textures"]) {
    const nlohmann::json& sampler = document["samplers"].at(texture["sampler"].get<std::size_t>());
    CHECK(sampler["minFilter"] == 9729);  // LINEAR
    CHECK(sampler["magFilter"] == 9729);
    CHECK(sampler["wrapS"] == 33071);  // CLAMP_TO_EDGE
    CHECK(sampler["wrapT"] == 33071);
  }
  for (const nlohmann::json& image : document["images"]) {
    CHECK(image["mimeType"] == "image/png");
    const nlohmann::json& view = document["bufferViews"].at(image["bufferView"].get<std::size_t>());
    const auto* const png =
        reinterpret_cast<const std::uint8_t*>(glb.binary.data()) + view["byteOffset"].get<std::size_t>();
    for (const std::size_t side : {16, 20}) {  // big-endian, in the first chunk
      const unsigned pixels = png[side] << 24 | png[side + 1] << 16 | png[side + 2] << 8 | png[side + 3];
      CHECK(pixels >= 1);
      CHECK(pixels <= unsigned(soup::kMinAtlasSide));
    }
  }
  for (const nlohmann::json& primitive : document["meshes"][0]["primitives"]) {
    CHECK(primitive["mode"] == 4);  // TRIANGLES
    CHECK(primitive["attributes"].contains("POSITION"));
    CHECK(primitive["attributes"].contains("TEXCOORD_0"));
  }
}

TEST_CASE("with a vertex share a model has no mesh and its vertices lie on a grid", "[model_file][model_bytes]") {
  soup::Model model = random_model(60, 36);
  for (std::size_t i = 0; i < model.vertices.size(); ++i)
    model.vertices[i] = {float(i % 7), float(i % 5), float(i % 11)};
  model.centre = {3, 2, 5};
  model.scale = 0.2;
  soup::ModelFileOptions options;
  options.plain_colours = false;
  options.cameras = {some_camera("a", true, 1), some_camera("b", false, 2)};
  const auto floats = soup::encode_model(model, options);
  options.vertex_share = 1.0 / 16;
  const auto bytes = soup::encode_model(model, options);
  nlohmann::json document = soup::decode_glb(bytes, "memory").document;
  CHECK(extension_of(document)["version"] == 4);
  for (const char* list : {"meshes", "accessors", "images"}) CHECK(!document.contains(list));
  CHECK(document["extensionsRequired"] == nlohmann::json({"TRISOUP_neural_textures"}));

  // The triangles are in another order and are identified by their textures.
  const soup::Model read = soup::decode_model(bytes, "memory").model;
  REQUIRE(read.triangles() == 60);
  const auto texture = [](const soup::Model& m, std::size_t t) {
    const auto begin = m.lattice.begin() + std::ptrdiff_t(m.textures[t].lattice_offset) * 8;
    return std::vector<std::uint8_t>(begin, begin + std::ptrdiff_t(soup::samples_at(m.textures[t].level_max)) * 8);
  };
  std::size_t found = 0;
  for (std::size_t t = 0; t < 60; ++t)
    for (std::size_t u = 0; u < 60; ++u) {
      if (texture(model, t) != texture(read, u)) continue;
      ++found;
      // At a distance of 4 normalised units, a sixteenth of a pixel is 0.025 in dataset units.
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(glm::distance(model.vertices[3 * t + k], read.vertices[3 * u + k]) < 0.025);
    }
  CHECK(found == 60);
  CHECK(read.mlp.parameters == model.mlp.parameters);

  const auto parts = soup::bytes_by_part(bytes, "x"), before = soup::bytes_by_part(floats, "x");
  CHECK(before["vertices"] == 60 * 36);
  CHECK(parts["vertices"] < 60 * 14);
  std::size_t sum = 0;
  for (const auto& part : parts) sum += part.get<std::size_t>();
  CHECK(sum == bytes.size());

  const auto refuses = [&](const char* what, auto&& edit) {
    CHECK_THROWS_WITH(soup::decode_model(edited(bytes, edit), "model.glb"), Contains("model.glb") && Contains(what));
  };
  refuses("its vertices are damaged", [](auto& j) { extension_of(j)["vertices"]["crc32"] = 1; });
  refuses("truncated", [](auto& j) { extension_of(j)["triangles"] = 0x5555555555555555u; });
  refuses("no triangles", [](auto& j) { extension_of(j)["triangles"] = 0; });
  refuses("JSON", [](auto& j) { extension_of(j)["version"] = 3; });
  refuses("whole number", [](auto& j) { extension_of(j)["vertices"]["bufferView"] = -1; });
  // Without cameras there is no pixel size, so vertices stay exact.
  options.cameras.clear();
  CHECK(same(model, soup::decode_model(soup::encode_model(model, options), "memory").model));
}

TEST_CASE("cameras are read back up to rounding to float", "[model_file][model_cameras]") {
  soup::ModelFileOptions options;
  for (int i = 0; i < 40; ++i)
    options.cameras.push_back(some_camera("photographs/" + std::to_string(i), i % 8 == 0, 100 + i));
  for (const std::size_t lenses : {1u, 3u}) {
    for (std::size_t i = 0; i < options.cameras.size(); ++i) options.cameras[i].camera.fx = 50.25 + double(i % lenses);
    const auto bytes = soup::encode_model(random_model(2, 1), options);
    const auto& cameras = soup::decode_model(bytes, "memory").cameras;
    REQUIRE(cameras.size() == options.cameras.size());
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const scene::Camera &was = options.cameras[i].camera, &is = cameras[i].camera;
      CHECK(cameras[i].name == options.cameras[i].name);
      CHECK(cameras[i].test == options.cameras[i].test);
      CHECK(std::tuple(is.width, is.height, is.fx, is.fy, is.cx, is.cy) ==
            std::tuple(was.width, was.height, was.fx, was.fy, was.cx, was.cy));
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) CHECK(is.world_to_camera[c][r] == Approx(was.world_to_camera[c][r]).margin(3e-7));
    }
    // A camera takes 28 bytes for the pose, and its name. A lens is stored once.
    CHECK(soup::bytes_by_part(bytes, "x")["cameras"].get<std::size_t>() < 40 * (28 + 24) + lenses * 100 + 250);
  }
}

TEST_CASE("cameras that a file may not have are refused by the writer, which names the photograph",
          "[model_file][model_cameras]") {
  soup::ModelFileOptions options;
  for (int i = 0; i < 3; ++i) options.cameras.push_back(some_camera("p" + std::to_string(i), false, 100 + i));
  soup::Model model = random_model(2, 1);
  CHECK_NOTHROW(soup::encode_model(model, options));
  const auto refuses = [&](const char* problem, const std::function<void(scene::Camera&)>& change) {
    soup::ModelFileOptions changed = options;
    change(changed.cameras[1].camera);
    CHECK_THROWS_WITH(soup::encode_model(model, changed), Contains("p1: a model cannot store") && Contains(problem));
  };
  refuses("focal length", [](scene::Camera& c) { c.fx = 1e6; });
  refuses("focal length", [](scene::Camera& c) { c.fy = 0.001; });
  refuses("focal length", [](scene::Camera& c) { c.fy = 0.001000000001; });  // rounded to 0.001 in the file
  refuses("principal point", [](scene::Camera& c) { c.cx = NAN; });
  refuses("position", [](scene::Camera& c) { c.world_to_camera[3].y = -2e6; });
  refuses("position", [](scene::Camera& c) { c.world_to_camera[3].z = INFINITY; });
  refuses("position", [](scene::Camera& c) { c.world_to_camera[3].x = 999999.99; });  // 1e6 as a float
  refuses("rotation", [](scene::Camera& c) { c.world_to_camera[0] *= 1.1; });
  refuses("size", [](scene::Camera& c) { c.width = 70'000; });
  model.scale = 1e-10;
  CHECK_THROWS_WITH(soup::encode_model(model, options), Contains("scale 1e-10, which a model cannot store"));
}

TEST_CASE("cameras of earlier files are read, invalid ones refused", "[model_file][model_cameras]") {
  soup::ModelFileOptions options;
  options.cameras = {some_camera("a", true, 1), some_camera("b", false, 2)};
  const auto bytes = soup::encode_model(random_model(2, 1), options);
  using nlohmann::json;
  const json row = {{"name", "c"},        {"test", true},
                    {"size", {40, 30}},   {"focal", {50, 51}},
                    {"centre", {20, 15}}, {"world_to_camera", {1, 0, 0, 4, 0, 0, -1, 5, 0, 1, 0, 6}}};
  const auto with = [&](const json& rows) {
    return edited(bytes, [&](json& j) { extension_of(j)["cameras"] = rows; });
  };
  const soup::ModelCamera c = soup::decode_model(with(json::array({row})), "memory").cameras.at(0);
  CHECK(c.name == "c");
  CHECK(c.test);
  CHECK(c.camera.fy == 51);
  CHECK(glm::dvec3(c.camera.world_to_camera * glm::dvec4(1, 2, 3, 1)) == glm::dvec3(5, 2, 8));

  const auto refuses = [&](const char* what, auto&& edit) {
    CHECK_THROWS_WITH(
        soup::decode_model(edited(bytes, [&](json& j) { edit(extension_of(j)["cameras"]); }), "model.glb"),
        Contains("model.glb") && Contains(what));
  };
  refuses("numbers of poses and cameras", [](json& cameras) { cameras["names"].push_back("more"); });
  refuses("numbers of poses and cameras", [](json& cameras) { cameras["names"] = "ab"; });
  refuses("whole number", [](json& cameras) { cameras["poses"] = -1; });
  refuses("numbers of poses and cameras", [](json& cameras) { cameras["poses"] = 0; });
  refuses("test view", [](json& cameras) { cameras["test"] = {2}; });
  refuses("whole number", [](json& cameras) { cameras["test"] = {-1}; });
  refuses("JSON", [](json& cameras) { cameras["lens"] = {0, 7}; });
  refuses("JSON", [](json& cameras) { cameras["lenses"] = json::array(); });
  refuses("JSON", [](json& cameras) { cameras.erase("test"); });
  refuses("a camera is not valid", [](json& cameras) { cameras["lenses"][0]["focal"] = {0, 50}; });
  refuses("a camera is not valid", [](json& cameras) { cameras["lenses"][0]["size"] = {-4, 30}; });
  json turned = row;
  turned["world_to_camera"][0] = 2;
  CHECK_THROWS_WITH(soup::decode_model(with(json::array({turned})), "model.glb"), Contains("a camera is not valid"));
  // Poses that are not rotations, or not numbers.
  const soup::Glb glb = soup::decode_glb(bytes, "memory");
  for (const float value : {3.0f, std::nanf("")}) {
    std::vector<std::byte> binary(glb.binary.begin(), glb.binary.end());
    json document = glb.document;
    const json& view = document["bufferViews"][extension_of(document)["cameras"]["poses"].get<std::size_t>()];
    std::memcpy(&binary[view["byteOffset"].get<std::size_t>()], &value, sizeof value);
    CHECK_THROWS_WITH(soup::decode_model(soup::encode_glb(document, binary, "memory"), "model.glb"),
                      Contains("a camera is not valid"));
  }
}

TEST_CASE("colours of a palette are near the full colours, and the alpha mask is unchanged", "[model_file][palette]") {
  soup::Model model = random_model(60, 23);
  soup::ModelFileOptions few;
  few.colour_palette = true;
  const auto whole_bytes = soup::encode_model(model, {}), few_bytes = soup::encode_model(model, few);
  CHECK(few_bytes.size() < whole_bytes.size());
  CHECK(same(model, soup::decode_model(few_bytes, "memory").model));
  const soup::Glb a = soup::decode_glb(whole_bytes, "memory"), b = soup::decode_glb(few_bytes, "memory");
  const auto image = [](const soup::Glb& glb) {
    return decode_image(view_of(glb, glb.document["images"][0]["bufferView"]), "picture");
  };
  const Image plain = image(a), reduced = image(b);
  REQUIRE((plain.width == reduced.width && plain.height == reduced.height));
  std::vector<std::uint32_t> levels;
  for (const soup::TextureEntry& row : model.textures) levels.push_back(row.level_max);
  const soup::Atlas atlas = soup::make_atlas(levels);
  double squares = 0, samples = 0;
  std::size_t moved = 0;
  const auto compare = [&](const glm::ivec2& texel) {
    const std::size_t at = (std::size_t(texel.y) * std::size_t(plain.width) + std::size_t(texel.x)) * 4;
    moved += (plain.rgba[at + 3] >= 128) != (reduced.rgba[at + 3] >= 128);
    for (std::size_t c = 0; c < 3; ++c, ++samples)
      squares += std::pow(double(plain.rgba[at + c]) - reduced.rgba[at + c], 2);
  };
  for (const soup::AtlasPlace& place : atlas.places) {
    soup::each_lattice_point(place.level,
                             [&](int x, int y, std::uint32_t) { compare(soup::atlas_texel(place, x, y)); });
    soup::each_gutter_texel(place.level, [&](const soup::GutterTexel& gutter) {
      compare(soup::atlas_texel(place, gutter.at.x, gutter.at.y));
    });
  }
  CHECK(moved == 0);
  // The colours fill the cube. Half of them share 224 cells of side 42, the others 32 cells of side 80. The error per
  // channel is then 12 and 23.
  CHECK(std::sqrt(squares / samples) < std::sqrt((12.0 * 12 + 23.0 * 23) / 2));
}

TEST_CASE("truncated, damaged and foreign files are refused", "[model_file]") {
  const auto bytes = soup::encode_model(random_model(20, 4), {});
  for (std::size_t n = 0; n < bytes.size(); n += 1 + bytes.size() / 200)
    CHECK_THROWS_AS(soup::decode_model(std::span(bytes).first(n), "cut"), Error);
  soup::Random random(6);
  for (int i = 0; i < 300; ++i) {
    auto copy = bytes;
    for (int k = 0; k < 3; ++k) copy[random.bits() % copy.size()] = static_cast<std::byte>(random.bits());
    try {
      soup::decode_model(copy, "damaged");
    } catch (const Error& e) {
      CHECK(std::string(e.what()).find('\n') == std::string::npos);
    }
  }
  const auto plain = soup::encode_glb({{"asset", {{"version", "2.0"}}}}, {}, "memory");
  CHECK_THROWS_WITH(soup::decode_model(plain, "plain.glb"),
                    Contains("plain.glb") && Contains("TRISOUP_neural_textures"));
  CHECK_THROWS_WITH(soup::read_model("no/such/model.glb"), Contains("no/such/model.glb"));
}

TEST_CASE("a model file with invalid values in its JSON is refused", "[model_file]") {
  const auto version = GENERATE(1, 3);
  CAPTURE(version);
  const auto bytes = version == 1 ? first_version() : soup::encode_model(random_model(20, 4), {});
  using nlohmann::json;
  const auto refuses = [&](const char* what, auto&& edit) {
    CHECK_THROWS_WITH(soup::decode_model(edited(bytes, edit), "model.glb"), Contains("model.glb") && Contains(what));
  };
  refuses("version 5", [](json& j) { extension_of(j)["version"] = 5; });
  refuses("version 0", [](json& j) { extension_of(j)["version"] = 0; });
  refuses("whole number", [](json& j) { extension_of(j)["triangles"] = 1e300; });
  refuses("whole number", [](json& j) { j["bufferViews"][0]["byteOffset"] = "0"; });
  refuses("exceeds the file", [](json& j) { j["bufferViews"][0]["byteLength"] = 0xffffffffffffffffu; });
  refuses("number of vertices", [](json& j) { extension_of(j)["triangles"] = 0x5555555555555555u; });
  refuses("number of vertices", [](json& j) { extension_of(j)["triangles"] = 0; });
  refuses("MLP", [](json& j) { extension_of(j)["mlp"] = 0; });
  refuses("centre or scale", [](json& j) { extension_of(j)["scale"] = 0; });
  refuses("background", [](json& j) { extension_of(j)["background"] = {1e300, 0, 0}; });
  refuses("background", [](json& j) { extension_of(j)["background"] = {0, 9, 0}; });
  refuses("harmonics", [](json& j) { extension_of(j)["sphericalHarmonicsDegree"] = 3; });
  refuses("JSON", [](json& j) { extension_of(j)["background"] = nullptr; });
  refuses("JSON", [](json& j) { j["meshes"] = 7; });
  if (version == 1) {
    refuses("whole number", [](json& j) { extension_of(j)["places"] = -1; });
    refuses("texture table", [](json& j) { extension_of(j)["places"] = extension_of(j)["mlp"]; });
    refuses("number of atlas pages", [](json& j) { extension_of(j)["pages"] = 1; });
    refuses("number of atlas pages", [](json& j) {
      const json page = extension_of(j)["pages"][0];
      extension_of(j)["pages"] = json(257, page);
    });
    refuses("texture table is not valid", [](json& j) { extension_of(j)["pages"] = json::array(); });
    refuses("not a PNG", [](json& j) { j["images"][1]["bufferView"] = 0; });
  } else {
    refuses("JSON", [](json& j) { extension_of(j).erase("textures"); });
    refuses("whole number", [](json& j) { extension_of(j)["textures"]["bufferView"] = -1; });
    refuses("its textures are damaged", [](json& j) { extension_of(j)["textures"]["crc32"] = 1; });
    refuses("its textures are damaged", [](json& j) { extension_of(j)["textures"]["bufferView"] = 0; });
    refuses("number of texture steps", [](json& j) { extension_of(j)["textures"]["steps"] = {1, 1}; });
    refuses("number of texture steps", [](json& j) { extension_of(j)["textures"]["steps"] = "1"; });
    refuses("texture step is not valid", [](json& j) { extension_of(j)["textures"]["steps"][7] = 0; });
    refuses("texture step is not valid", [](json& j) { extension_of(j)["textures"]["steps"][0] = 129; });
    refuses("whole number", [](json& j) { extension_of(j)["textures"]["steps"][0] = 1.5; });
  }
}

TEST_CASE("a file of version 1 is read and is smaller when written again", "[model_file]") {
  const auto bytes = first_version();
  const soup::ModelFile file = soup::decode_model(bytes, "memory");
  CHECK(file.model.triangles() == 3);
  CHECK(file.texture_steps == soup::kExactTextures);
  CHECK(std::set<std::uint8_t>(file.model.lattice.begin(), file.model.lattice.end()).size() > 3);
  soup::ModelFileOptions options;
  options.settings = file.settings;
  CHECK(same(file.model, soup::decode_model(soup::encode_model(file.model, options), "memory").model));
  for (const char* later : {"_2", "_3"})
    CHECK(same(file.model, soup::decode_model(three_triangles(later), "memory").model));
}

TEST_CASE("rounded textures take fewer bytes, and their steps are stored", "[model_file]") {
  soup::Model model = random_model(60, 31);
  const auto whole = soup::encode_model(model, {});
  soup::ModelFileOptions options;
  options.texture_steps = soup::texture_steps(6);
  CHECK_THROWS_WITH(soup::encode_model(model, options), Contains("round its textures"));
  soup::round_textures(model.lattice, model.textures, options.texture_steps);
  const auto bytes = soup::encode_model(model, options);
  CHECK(bytes.size() + model.lattice.size() / 4 < whole.size());
  const soup::ModelFile file = soup::decode_model(bytes, "memory");
  CHECK(same(model, file.model));
  CHECK(file.texture_steps == options.texture_steps);
}

TEST_CASE("a model file with an invalid binary part is refused", "[model_file]") {
  const auto bytes = first_version();
  const soup::Glb glb = soup::decode_glb(bytes, "memory");
  const auto refuses = [&](const char* what, auto&& view_index, auto&& edit) {
    std::vector<std::byte> binary(glb.binary.begin(), glb.binary.end());
    const nlohmann::json& view = glb.document["bufferViews"][view_index(glb.document)];
    edit(std::span(binary).subspan(view["byteOffset"].get<std::size_t>(), view["byteLength"].get<std::size_t>()));
    CHECK_THROWS_WITH(soup::decode_model(soup::encode_glb(glb.document, binary, "memory"), "model.glb"),
                      Contains("model.glb") && Contains(what));
  };
  using nlohmann::json;
  const auto places = [](json j) { return extension_of(j)["places"].get<std::size_t>(); };
  const auto mlp = [](json j) { return extension_of(j)["mlp"].get<std::size_t>(); };
  const auto vertices = [](const json&) { return std::size_t{0}; };
  const auto features = [](json j) {
    return j["images"][extension_of(j)["pages"][0]["features"][0].get<std::size_t>()]["bufferView"].get<std::size_t>();
  };
  // Rows of the table: u16 x0, u16 y0, u8 level, u8 page, u8 turned.
  refuses("outside its page", places, [](auto row) { row[1] = std::byte{0xff}; });
  refuses("outside its page", places, [](auto row) { row[3] = std::byte{0xff}; });
  refuses("outside its page", places, [](auto row) {  // turned at the origin: extends beyond the left of the page
    row[0] = row[1] = row[2] = row[3] = std::byte{0};
    row[6] = std::byte{1};
  });
  refuses("texture table is not valid", places, [](auto row) { row[4] = std::byte{6}; });
  refuses("texture table is not valid", places, [](auto row) { row[5] = std::byte{1}; });
  refuses("texture table is not valid", places, [](auto row) { row[6] = std::byte{2}; });
  const auto nan = [](auto floats) { std::fill_n(floats.begin(), 4, std::byte{0xff}); };
  refuses("vertex", vertices, nan);
  refuses("MLP weight", mlp, nan);
  // PNG files with damaged pixels are detected by their checksums.
  refuses("texture", features, [](auto png) { png[png.size() / 2] ^= std::byte{0x55}; });
  refuses("texture", features, [](auto png) { std::fill(png.begin() + 40, png.end(), std::byte{0}); });
  refuses("not a PNG", features, [](auto png) { png[1] = std::byte{'X'}; });

  auto other = bytes;
  other[0] = std::byte{'G'};
  CHECK_THROWS_WITH(soup::decode_model(other, "model.glb"), Contains("model.glb") && Contains("binary glTF"));
  other = bytes;
  other[4] = std::byte{1};
  CHECK_THROWS_WITH(soup::decode_model(other, "model.glb"), Contains("glTF version 1"));
  other = bytes;
  other.push_back(std::byte{0});
  CHECK_THROWS_WITH(soup::decode_model(other, "model.glb"), Contains("length"));
}

TEST_CASE("a small file whose pages would unpack to gigabytes is refused before unpacking", "[model_file]") {
  // An empty page of 2,048 x 2,048 texels is about 20 KB of PNG, and the JSON can reference it many times.
  const auto bytes = first_version();
  soup::Glb glb = soup::decode_glb(bytes, "memory");
  Image empty{2048, 2048, {}};
  empty.rgba.resize(std::size_t(2048) * 2048 * 4, 0);
  const std::string png = encode_png(empty, "memory");
  std::vector<std::byte> binary(glb.binary.begin(), glb.binary.end());
  glb.document["images"].push_back({{"bufferView", glb.document["bufferViews"].size()}, {"mimeType", "image/png"}});
  glb.document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", png.size()}});
  const auto png_bytes = std::as_bytes(std::span(png));
  binary.insert(binary.end(), png_bytes.begin(), png_bytes.end());
  const std::size_t image = glb.document["images"].size() - 1;
  nlohmann::json& pages = extension_of(glb.document)["pages"];
  for (int i = 0; i < 255; ++i) pages.push_back({{"features", {image, image}}});
  CHECK_THROWS_WITH(soup::decode_model(soup::encode_glb(glb.document, binary, "memory"), "model.glb"),
                    Contains("more texels"));
}

TEST_CASE("a model that could not be read back is not written", "[model_file]") {
  const auto refuses = [](const char* what, auto&& edit) {
    soup::Model model = random_model(5, 8);
    soup::ModelFileOptions options;
    edit(model, options);
    CHECK_THROWS_WITH(soup::encode_model(model, options), Contains(what));
  };
  using soup::Model;
  using Options = soup::ModelFileOptions;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refuses("no triangles", [](Model& m, Options&) { m = {}; });
  refuses("vertices", [](Model& m, Options&) { m.vertices.pop_back(); });
  refuses("outside the lattice", [](Model& m, Options&) { m.lattice.resize(8); });
  refuses("outside the lattice", [](Model& m, Options&) { m.textures[2].level_max = 40; });
  refuses("parameters", [](Model& m, Options&) { m.mlp.parameters.pop_back(); });
  refuses("finite", [&](Model& m, Options&) { m.mlp.parameters[3] = nan; });
  refuses("finite", [&](Model& m, Options&) { m.vertices[3].y = nan; });
  refuses("finite", [](Model& m, Options&) { m.scale = 0; });
  refuses("up direction", [](Model&, Options& o) { o.up = glm::dvec3(0); });
  refuses("UTF-8", [](Model&, Options& o) { o.settings = "\xff"; });
  refuses("atlas side", [](Model&, Options& o) { o.atlas_side = 1 << 14; });
}

TEST_CASE("the root node turns the dataset's up axis to +Y", "[model_file]") {
  for (const glm::dvec3 up : {glm::dvec3(0, 0, 1), glm::dvec3(-3, 0, 0), glm::dvec3(0.3, -2, 0.9)}) {
    soup::ModelFileOptions options;
    options.up = up;
    const auto bytes = soup::encode_model(random_model(1, 1), options);
    const auto m = soup::decode_glb(bytes, "memory").document["nodes"][0]["matrix"].get<std::vector<double>>();
    const glm::dmat3 rotation{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}};
    CHECK(glm::length(rotation * glm::normalize(up) - glm::dvec3(0, 1, 0)) < 1e-12);
    CHECK(glm::determinant(rotation) == Approx(1));
    CHECK(glm::length(rotation * glm::dvec3(1, 2, 3)) == Approx(std::sqrt(14.0)));
  }
}

TEST_CASE("a model of 2,000 triangles is read back unchanged", "[model_file]") {
  REQUIRE_SHARED_FOLDER(shared);
  const test::Npz npz = test::load_npz(shared / "golden" / "M_lego_trained.npz");
  soup::Model model;
  const auto& v = npz.at("V").f;
  for (const std::int32_t i : npz.at("F").i) model.vertices.emplace_back(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  model.textures = soup::make_texture_table(model.vertices.size() / 3, {5, 5}).entries;
  for (auto& row : model.textures) row.source_offset = row.level_min = 0;
  for (const std::int32_t value : npz.at("lut_u8").i) model.lattice.push_back(static_cast<std::uint8_t>(value));
  std::vector<float> mlp;
  for (const char* name : {"mlp_w1", "mlp_b1", "mlp_w2", "mlp_b2", "mlp_w3", "mlp_b3"})
    mlp.insert(mlp.end(), npz.at(name).f.begin(), npz.at(name).f.end());
  model.mlp.parameters = mlp;
  soup::ModelFileOptions options;
  options.baked.assign(model.lattice.size() / soup::kChannels * 3, 0);  // as above
  const auto bytes = soup::encode_model(model, options);
  WARN("model.glb: " << bytes.size() << " bytes for " << model.lattice.size() << " texture values");
  CHECK(bytes.size() < 12 * model.lattice.size() / 10);
  CHECK(same(model, soup::decode_model(bytes, "memory").model));
}

// Hidden. Writes models for the glTF validator: one with one page to the path in TRISOUP_WRITE_MODEL, one with several
// pages beside it.
TEST_CASE("write a model", "[.write_model]") {
  const char* path = std::getenv("TRISOUP_WRITE_MODEL");
  REQUIRE(path != nullptr);
  soup::ModelFileOptions options;
  options.up = glm::dvec3(0, 0, 1);
  options.settings = {{"steps", 5}};
  soup::write_model(path, random_model(50, 1), options);
  options.atlas_side = soup::kMinAtlasSide;
  options.up.reset();
  options.shown_up = glm::dvec3(0.2, -0.9, 0.4);
  soup::write_model(std::string(path) + ".pages.glb", random_model(2500, 1), options);
  options.cameras = {some_camera("a", true, 1), some_camera("b", false, 2)};
  options.plain_colours = false;
  soup::write_model(std::string(path) + ".lean.glb", random_model(50, 1), options);
  options.vertex_share = 0.1;
  soup::write_model(std::string(path) + ".coded.glb", random_model(50, 1), options);
}
