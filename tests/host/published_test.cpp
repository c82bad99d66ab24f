// Tests engine/format/published.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/read_file.h"
#include "common/host.h"
#include "format/published.h"
#include "image/image_file.h"
#include "soup/random.h"
#include "soup/texture_table.h"
#include "temporary_folder.h"

using namespace trisoup;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

soup::Model model_of(const std::vector<std::uint32_t>& levels, std::uint64_t seed = 1) {
  soup::Random random(seed);
  soup::Model model;
  std::vector<soup::TextureLevels> all;
  for (const std::uint32_t level : levels) {
    all.push_back({level, level});
    for (int k = 0; k < 3; ++k) model.vertices.emplace_back(random.uniform01(), random.uniform01(), random.uniform01());
  }
  const soup::TextureTable table = soup::make_texture_table(all);
  model.textures = table.entries;
  for (auto& row : model.textures) row.source_offset = row.level_min = 0;
  for (std::uint64_t i = 0; i < table.lattice_samples * 8; ++i)
    model.lattice.push_back(static_cast<std::uint8_t>(random.bits()));
  for (float& w : model.mlp.parameters) w = random.uniform01() - 0.5f;
  model.background = {0.25f, 0.5f, 1.0f};
  model.origin = {10, -20, 0.5};
  return model;
}

nlohmann::json json_in(const fs::path& path) { return nlohmann::json::parse(read_file(path)); }

}  // namespace

TEST_CASE("a soup is written as the files of the published viewer", "[published]") {
  const test::TemporaryFolder folder;
  const soup::Model model = model_of(std::vector<std::uint32_t>(3, 2));
  write_published(folder.path(), "b scene", model, {0, 0, 1});
  write_published(folder.path(), "a", model, {0, 0, 1});
  write_published(folder.path(), "a", model, {0, 0, 1});
  CHECK(json_in(folder / "models.json") == nlohmann::json({"a", "b scene"}));
  const nlohmann::json meta = json_in(folder / "a" / "meta.json"), mlp = json_in(folder / "a" / "mlp_weights.json");
  CHECK(meta == nlohmann::json({{"up", {0.0, 0.0, 1.0}},
                                {"level", 2},
                                {"background", {0.25, 0.5, 1.0}},
                                {"num_faces", 3},
                                {"num_verts", 9}}));
  // Rows of weights are outputs: W2[1][0] is the 17th value of its layer.
  CHECK(mlp["W2"][16].get<float>() == model.mlp.parameters[272 + 16]);
  CHECK(mlp["b3"][2].get<float>() == model.mlp.parameters[594]);

  // 15 samples per triangle: sample s of triangle f is texel 15 f + s.
  for (int half = 0; half < 2; ++half) {
    const Image image = read_image(folder / "a" / (half ? "lut1.png" : "lut0.png"));
    CHECK(image.width == 45);
    CHECK(image.height == 1);
    for (std::size_t i = 0; i < 45; ++i)
      CHECK(std::memcmp(&image.rgba[4 * i], &model.lattice[8 * i + 4 * half], 4) == 0);
  }

  const std::string ply = read_file(folder / "a" / "mesh.ply"), end = "end_header\n";
  const std::size_t at = ply.find(end) + end.size();
  CHECK(ply.substr(0, at) ==
        "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 3\nproperty list uchar int vertex_indices\nend_header\n");
  REQUIRE(ply.size() == at + 9 * 12 + 3 * 13);
  glm::vec3 fifth;
  std::memcpy(&fifth, &ply[at + 4 * 12], 12);
  CHECK(fifth == glm::vec3(glm::dvec3(model.vertices[4]) + model.origin));
  std::int32_t corner = 0;
  std::memcpy(&corner, &ply[at + 9 * 12 + 2 * 13 + 1 + 4], 4);
  CHECK(corner == 7);
}

TEST_CASE("look-up textures are 4,096 texels wide and padded with zeros", "[published]") {
  const test::TemporaryFolder folder;
  const soup::Model model = model_of(std::vector<std::uint32_t>(30, 4));  // 30 x 153 = 4,590 samples
  write_published(folder.path(), "x", model, {0, 1, 0});
  const Image image = read_image(folder / "x" / "lut1.png");
  CHECK(image.width == 4096);
  CHECK(image.height == 2);
  CHECK(std::memcmp(&image.rgba[4 * 4589], &model.lattice[8 * 4589 + 4], 4) == 0);
  CHECK(std::all_of(image.rgba.begin() + 4 * 4590, image.rgba.end(), [](std::uint8_t c) { return c == 0; }));
}

TEST_CASE("files of the published viewer are read back", "[published]") {
  const test::TemporaryFolder folder;
  const soup::Model model = model_of(std::vector<std::uint32_t>(30, 4));
  write_published(folder.path(), "x", model, {0, 0, -2});
  CHECK(soup::is_published(folder / "x"));
  CHECK_FALSE(soup::is_published(folder.path()));
  const soup::ModelFile file = soup::read_published(folder / "x");
  CHECK(file.model.lattice == model.lattice);
  CHECK(file.model.mlp.parameters == model.mlp.parameters);
  CHECK(file.model.background == model.background);
  REQUIRE(file.up);
  CHECK(*file.up == glm::dvec3(0, 0, -1));
  REQUIRE(file.model.vertices.size() == 90);
  for (std::size_t i = 0; i < 90; ++i)
    CHECK(file.model.vertices[i] == glm::vec3(glm::dvec3(model.vertices[i]) + model.origin));
  // It can be written as a model.glb and lies near the origin.
  soup::ModelFileOptions options;
  options.baked.assign(file.model.lattice.size() / soup::kChannels * 3, 0);  // colours do not matter here
  const soup::ModelFile again = soup::decode_model(soup::encode_model(file.model, options), "x");
  CHECK(again.model.lattice == model.lattice);
  for (const glm::vec3& v : soup::normalised_vertices(again.model)) CHECK(glm::length(v) < 1.5f);
}

TEST_CASE("triangles of several levels are resampled to the highest level", "[published]") {
  const std::vector<std::uint32_t> levels{0, 3, 1, 5, 2};
  const soup::Model model = model_of(levels), even = soup::at_one_level(model, 5);
  REQUIRE(even.lattice.size() == 5 * 561 * 8);
  // Equal everywhere, not only at lattice points, up to the rounding of three samples.
  soup::Random random(7);
  for (std::size_t t = 0; t < levels.size(); ++t) {
    CHECK(even.textures[t].level_max == 5);
    for (int i = 0; i < 200; ++i) {
      const float b0 = random.uniform01(), b1 = (1 - b0) * random.uniform01();
      const auto value = [&](const soup::Model& m, std::size_t c) {
        const auto cell = f32::lattice_cell(b0, b1, m.textures[t].level_max);
        const auto at = [&](std::uint32_t s) { return float(m.lattice[(m.textures[t].lattice_offset + s) * 8 + c]); };
        return f32::lattice_mix(cell, at(cell.i0), at(cell.i1), at(cell.i2));
      };
      for (std::size_t c = 0; c < 8; ++c) CHECK(std::abs(value(model, c) - value(even, c)) < 0.51f);
    }
  }
  // The triangle that had this level already is unchanged.
  CHECK(std::equal(&even.lattice[3 * 561 * 8], &even.lattice[4 * 561 * 8],
                   &model.lattice[std::size_t(model.textures[3].lattice_offset) * 8]));
  CHECK_THROWS_WITH(soup::at_one_level(model, 4), Contains("level 5"));
}

TEST_CASE("inconsistent files of the published viewer are refused", "[published]") {
  const test::TemporaryFolder folder;
  write_published(folder.path(), "x", model_of(std::vector<std::uint32_t>(4, 1)), {0, 0, 1});
  const fs::path x = folder / "x";
  SECTION("fewer faces than textures") {
    fs::copy_file(x / "lut0.png", folder / "lut0.png");
    write_published(folder.path(), "x", model_of(std::vector<std::uint32_t>(3, 1)), {0, 0, 1});
    fs::copy_file(folder / "lut0.png", x / "lut0.png", fs::copy_options::overwrite_existing);
    CHECK_THROWS_WITH(soup::read_published(x), Contains("lut0.png") && Contains("24 x 1") && Contains("18 x 1"));
  }
  SECTION("wrong level") {
    folder.file("x/meta.json", R"({"level": 2})");
    CHECK_THROWS_WITH(soup::read_published(x), Contains("lut0.png") && Contains("level 2"));
    for (const char* wrong : {R"({"level": 6})", R"({"level": -1})", R"({"level": "high"})", R"({"up": [1]})",
                              R"({"background": [0, 2, 0]})", "{", "[]"}) {
      folder.file("x/meta.json", wrong);
      CHECK_THROWS_WITH(soup::read_published(x), Contains("meta.json"));
    }
  }
  SECTION("no meta.json: defaults of the published page") {
    fs::remove(x / "meta.json");
    CHECK_THROWS_WITH(soup::read_published(x), Contains("level 5"));
  }
  SECTION("an MLP of the wrong shape") {
    for (const char* wrong : {"", "[]", R"({"W1": [1, 2]})", R"({"W1": "many"})"}) {
      folder.file("x/mlp_weights.json", wrong);
      CHECK_THROWS_WITH(soup::read_published(x), Contains("mlp_weights.json"));
    }
    write_published(folder.path(), "x", model_of(std::vector<std::uint32_t>(4, 1)), {0, 0, 1});
    nlohmann::json mlp = json_in(x / "mlp_weights.json");
    mlp["W2"].erase(3);
    folder.file("x/mlp_weights.json", mlp.dump());
    CHECK_THROWS_WITH(soup::read_published(x), Contains("W2 has 255 values instead of 256"));
  }
  SECTION("a missing file") {
    for (const char* name : {"mesh.ply", "lut1.png", "mlp_weights.json"}) {
      write_published(folder.path(), "x", model_of(std::vector<std::uint32_t>(4, 1)), {0, 0, 1});
      fs::remove(x / name);
      CHECK_THROWS_WITH(soup::read_published(x), Contains(name));
    }
  }
  SECTION("an invalid list of scenes is not overwritten") {
    folder.file("models.json", "{\"mine\": 1}");
    CHECK_THROWS_WITH(write_published(folder.path(), "y", model_of({1}), {0, 0, 1}), Contains("models.json"));
    CHECK(read_file(folder / "models.json") == "{\"mine\": 1}");
    CHECK_FALSE(fs::exists(folder / "y"));
  }
}
