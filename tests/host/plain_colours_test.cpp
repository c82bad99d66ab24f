// Tests engine/format/plain_colours.cpp: colours of a mesh are read back as they were written.
#include <catch2/catch.hpp>

#include <functional>

#include "base/error.h"
#include "format/glb.h"
#include "format/model_file.h"
#include "format/plain_colours.h"
#include "soup/random.h"
#include "soup/texture_table.h"

using namespace trisoup;
using Catch::Contains;

namespace {

struct BakedFile {
  soup::Model model;
  soup::ModelFileOptions options;
  std::vector<std::byte> bytes() const { return soup::encode_model(model, options); }
};

/// Random textures of levels 0 to 3 and random baked colours.
BakedFile baked_file(std::uint32_t triangles) {
  soup::Random random(triangles);
  BakedFile file;
  std::vector<soup::TextureLevels> levels;
  for (std::uint32_t t = 0; t < triangles; ++t) levels.push_back({t % 4, t % 4});
  file.model.textures = soup::make_texture_table(levels).entries;
  std::size_t samples = 0;
  for (soup::TextureEntry& row : file.model.textures) {
    row.source_offset = row.level_min = 0;
    samples += soup::samples_at(row.level_max);
  }
  for (std::uint32_t i = 0; i < 3 * triangles; ++i)
    file.model.vertices.emplace_back(random.uniform01(), random.uniform01(), random.uniform01());
  for (std::size_t i = 0; i < samples * soup::kChannels; ++i)
    file.model.lattice.push_back(static_cast<std::uint8_t>(random.bits()));
  for (std::size_t i = 0; i < samples * 3; ++i) file.options.baked.push_back(static_cast<std::uint8_t>(random.bits()));
  return file;
}

/// The file after a change of its JSON.
std::vector<std::byte> changed(const BakedFile& file, const std::function<void(nlohmann::json&)>& change) {
  const std::vector<std::byte> bytes = file.bytes();
  soup::Glb glb = soup::decode_glb(bytes, "x");
  change(glb.document);
  return soup::encode_glb(glb.document, glb.binary, "x");
}

}  // namespace

TEST_CASE("baked colours are read back, from one page or several", "[plain_colours]") {
  BakedFile file = baked_file(GENERATE(1u, 7u, 4000u));
  file.options.atlas_side = soup::kMinAtlasSide;
  const auto plain = soup::read_plain_colours(file.bytes(), "x");
  REQUIRE(plain);
  REQUIRE(plain->lattice.size() == file.model.lattice.size());
  std::size_t wrong = 0;
  for (std::size_t s = 0; s < file.model.lattice.size() / soup::kChannels; ++s) {
    const std::uint8_t* const values = &plain->lattice[s * soup::kChannels];
    for (std::size_t c = 0; c < 3; ++c) wrong += values[c] != file.options.baked[3 * s + c];
    wrong += values[3] != 0;  // the share of the MLP
    wrong += values[7] != file.model.lattice[s * soup::kChannels + 7];
  }
  CHECK(wrong == 0);
}

TEST_CASE("a palette makes opacities binary", "[plain_colours]") {
  BakedFile file = baked_file(9);
  file.options.colour_palette = true;
  const auto plain = soup::read_plain_colours(file.bytes(), "x");
  REQUIRE(plain);
  for (std::size_t i = 7; i < plain->lattice.size(); i += soup::kChannels)
    CHECK(plain->lattice[i] == (file.model.lattice[i] >= 128 ? 255 : 0));
}

TEST_CASE("a file without baked colours has none", "[plain_colours]") {
  BakedFile file = baked_file(3);
  CHECK(soup::has_plain_colours(file.bytes(), "x"));
  file.options.plain_colours = false;
  CHECK_FALSE(soup::has_plain_colours(file.bytes(), "x"));
  CHECK_FALSE(soup::read_plain_colours(file.bytes(), "x"));
}

TEST_CASE("baked colours of another number of samples are refused", "[plain_colours]") {
  BakedFile file = baked_file(3);
  file.options.baked.pop_back();
  CHECK_THROWS_WITH(file.bytes(), Contains("bake them from this model"));
}

TEST_CASE("a damaged mesh is refused", "[plain_colours]") {
  const BakedFile file = baked_file(5);
  const std::vector<std::function<void(nlohmann::json&)>> changes{
      [](nlohmann::json& d) { d["meshes"][0]["primitives"][0].erase("material"); },
      [](nlohmann::json& d) { d["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 0; },
      [](nlohmann::json& d) { d["meshes"][0]["primitives"][0]["indices"] = 0; },
      [](nlohmann::json& d) { d["meshes"][0]["primitives"] = nlohmann::json::array(); },
      [](nlohmann::json& d) { d["meshes"][0]["primitives"].push_back(d["meshes"][0]["primitives"][0]); },
      [](nlohmann::json& d) { d["accessors"][1]["count"] = 4; },
      [](nlohmann::json& d) { d["images"][0]["bufferView"] = 0; },
      [](nlohmann::json& d) { d["textures"][0]["source"] = -1; },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    CAPTURE(i);
    CHECK_THROWS_WITH(soup::read_plain_colours(changed(file, changes[i]), "x.glb"), Contains("x.glb: "));
  }
  CHECK(soup::read_plain_colours(changed(file, [](nlohmann::json&) {}), "x.glb"));
}
