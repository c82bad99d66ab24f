// Tests engine/soup/model_file.cpp, atlas.cpp and bake.cpp.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <set>

#include "common/host.h"
#include "error.h"
#include "npz.h"
#include "shared_data.h"
#include "soup/atlas.h"
#include "soup/bake.h"
#include "soup/model_file.h"
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
    for (int k = 0; k < 3; ++k) model.vertices.emplace_back(random.uniform01(), random.uniform01() * 1e-3f, random.uniform01() * 1e4f);
  }
  const soup::TextureTable table = soup::make_texture_table(levels);
  model.textures = table.entries;
  for (auto& row : model.textures) row.source_offset = row.level_min = 0;
  for (std::uint64_t i = 0; i < table.lattice_samples * 8; ++i) model.lattice.push_back(static_cast<std::uint8_t>(random.bits()));
  for (float& w : model.mlp.parameters) w = random.uniform01() - 0.5f;
  model.background = {0.25f, 0.5f, 1.0f};
  model.centre = {1.0 / 3, -2e5, 1e-9};
  model.scale = 0.1234567890123456789;
  return model;
}

bool same(const soup::Model& a, const soup::Model& b) {
  if (a.triangles() != b.triangles() || a.vertices.size() != b.vertices.size() || a.lattice != b.lattice) return false;
  if (std::memcmp(a.vertices.data(), b.vertices.data(), a.vertices.size() * 12) != 0) return false;
  if (std::memcmp(a.textures.data(), b.textures.data(), a.textures.size() * 16) != 0) return false;
  return a.mlp.parameters == b.mlp.parameters && a.background == b.background && a.centre == b.centre && a.scale == b.scale;
}

}  // namespace

TEST_CASE("no two lattices or gutters of an atlas share a texel", "[atlas]") {
  soup::Random random(3);
  std::vector<std::uint32_t> levels;
  for (int t = 0; t < 333; ++t) levels.push_back(random.bits() % (soup::kMaxLevel + 1));
  const soup::Atlas atlas = soup::make_atlas(levels);
  std::set<std::tuple<int, int, int>> taken;
  std::size_t texels = 0;
  for (const soup::AtlasPlace& place : atlas.places) {
    const auto take = [&](int x, int y) {
      const glm::ivec2 texel = soup::atlas_texel(place, x, y);
      REQUIRE(texel.x >= 0);
      REQUIRE(texel.y >= 0);
      REQUIRE(texel.x < atlas.pages[place.page].x);
      REQUIRE(texel.y < atlas.pages[place.page].y);
      taken.insert({place.page, texel.x, texel.y});
      ++texels;
    };
    const int r = 1 << place.level;
    for (int y = 0; y <= r; ++y)
      for (int x = 0; x + y <= r; ++x) take(x, y);
    soup::each_gutter_texel(place.level, [&](int x, int y, int, int) { take(x, y); });
  }
  CHECK(taken.size() == texels);
}

TEST_CASE("bilinear sampling inside a triangle reads its own texels and gutter only", "[atlas]") {
  const std::vector<std::uint32_t> levels{5, 5, 3, 3, 0, 0, 2, 1};
  const soup::Atlas atlas = soup::make_atlas(levels);
  soup::Random random(5);
  for (const soup::AtlasPlace& place : atlas.places) {
    glm::vec2 uv[3];
    soup::atlas_uv(place, atlas.pages[place.page], uv);
    const int r = 1 << place.level;
    std::set<std::pair<int, int>> own;
    const auto add = [&](int x, int y) {
      const glm::ivec2 t = soup::atlas_texel(place, x, y);
      own.insert({t.x, t.y});
    };
    for (int y = 0; y <= r; ++y)
      for (int x = 0; x + y <= r; ++x) add(x, y);
    soup::each_gutter_texel(place.level, [&](int x, int y, int, int) { add(x, y); });
    for (int i = 0; i < 500; ++i) {
      double b0 = random.uniform01(), b1 = random.uniform01();
      if (b0 + b1 > 1) b0 = 1 - b0, b1 = 1 - b1;
      const glm::dvec2 at = b0 * glm::dvec2(uv[0]) + b1 * glm::dvec2(uv[1]) + (1 - b0 - b1) * glm::dvec2(uv[2]);
      const glm::dvec2 texel = at * glm::dvec2(atlas.pages[place.page]) - 0.5;
      for (int dy = 0; dy < 2; ++dy)
        for (int dx = 0; dx < 2; ++dx) {
          const double fx = texel.x - std::floor(texel.x), fy = texel.y - std::floor(texel.y);
          const double weight = (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy);
          if (weight < 1e-3) continue;  // rounding of the coordinates
          CHECK(own.contains({int(std::floor(texel.x)) + dx, int(std::floor(texel.y)) + dy}));
        }
    }
    // And a lattice point is a texel centre.
    const glm::dvec2 corner = glm::dvec2(uv[0]) * glm::dvec2(atlas.pages[place.page]) - 0.5;
    const glm::ivec2 expected = soup::atlas_texel(place, r, 0);
    CHECK(corner.x == Approx(expected.x).margin(1e-3));
    CHECK(corner.y == Approx(expected.y).margin(1e-3));
  }
}

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

TEST_CASE("a model file gives back what went in", "[model_file]") {
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

TEST_CASE("a model file that is cut, damaged or another's is refused", "[model_file]") {
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
  const std::string plain = R"({"asset":{"version":"2.0"}}  )";
  std::vector<std::byte> other;
  const auto put = [&](std::uint32_t v) { for (int s = 0; s < 32; s += 8) other.push_back(static_cast<std::byte>(v >> s)); };
  for (const std::uint32_t v : {0x46546c67u, 2u, std::uint32_t(12 + 8 + plain.size() + 8), std::uint32_t(plain.size()), 0x4e4f534au}) put(v);
  for (const char c : plain) other.push_back(static_cast<std::byte>(c));
  put(0);
  put(0x004e4942);
  CHECK_THROWS_WITH(soup::decode_model(other, "plain.glb"), Contains("plain.glb") && Contains("TRISOUP_neural_textures"));
  CHECK_THROWS_WITH(soup::read_model("no/such/model.glb"), Contains("no/such/model.glb"));
}

TEST_CASE("a trained model of 2,000 triangles survives its file", "[model_file]") {
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
  const auto bytes = soup::encode_model(model, {});
  WARN("model.glb of M_lego_trained: " << bytes.size() << " bytes, textures unpacked " << model.lattice.size());
  CHECK(same(model, soup::decode_model(bytes, "memory").model));
}

// Hidden: writes a model for the glTF validator, where TRISOUP_WRITE_MODEL says.
TEST_CASE("write a model", "[.write_model]") {
  const char* path = std::getenv("TRISOUP_WRITE_MODEL");
  REQUIRE(path != nullptr);
  soup::ModelFileOptions options;
  options.up = glm::dvec3(0, 0, 1);
  soup::write_model(path, random_model(50, 1), options);
}
