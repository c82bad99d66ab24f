// Tests engine/format/lattice_code.cpp and range_coder.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "base/error.h"
#include "format/lattice_code.h"
#include "format/range_coder.h"
#include "soup/random.h"
#include "soup/texture_table.h"

using namespace trisoup;
using Catch::Matchers::Contains;

namespace {

struct CodedTextures {
  std::vector<soup::TextureEntry> table;
  std::vector<std::uint8_t> values;
};

/// Textures of random levels with uniform noise of `noise` / 255 around the middle value.
CodedTextures noisy_textures(std::size_t triangles, std::uint32_t noise, std::uint64_t seed) {
  soup::Random random(seed);
  std::vector<soup::TextureLevels> levels;
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::uint32_t level = random.below(soup::kMaxLevel + 1);
    levels.push_back({level, level});
  }
  const soup::TextureTable table = soup::make_texture_table(levels);
  CodedTextures textures{table.entries, {}};
  for (std::size_t i = 0; i < table.lattice_samples * 8; ++i)
    textures.values.push_back(static_cast<std::uint8_t>(random.below(noise + 1) + (256 - noise - 1) / 2));
  return textures;
}

}  // namespace

TEST_CASE("an arithmetic coder needs about the entropy of the decisions", "[range_coder]") {
  for (const double often : {0.0, 0.001, 0.1, 0.5, 0.9, 1.0}) {
    CAPTURE(often);
    soup::Random random(3);
    std::vector<bool> decisions;
    for (int i = 0; i < 100000; ++i) decisions.push_back(random.uniform01() < often);
    soup::RangeEncoder encoder;
    soup::Chance written, read;
    for (const bool decision : decisions) encoder.code(written, decision);
    const std::vector<std::byte> bytes = encoder.finish();
    soup::RangeDecoder decoder(bytes);
    std::size_t wrong = 0;
    for (const bool decision : decisions) wrong += decoder.decision(read) != decision;
    CHECK(wrong == 0);
    CHECK(decoder.missing() == 0);
    const double entropy =
        often <= 0 || often >= 1 ? 0 : -often * std::log2(often) - (1 - often) * std::log2(1 - often);
    // The probability of an event that never occurs stops at 121 / 2^15, where its updates round to 0. Cost: 0.0053
    // bits per decision.
    CHECK(8.0 * double(bytes.size()) < 100000 * (1.02 * entropy + 0.0054) + 80);
  }
}

TEST_CASE("an arithmetic coder propagates carries through pending bytes", "[range_coder]") {
  // Unexpected decisions make the range small and `low` large.
  soup::Random random(8);
  for (int repeat = 0; repeat < 300; ++repeat) {
    std::vector<bool> decisions(200, true);
    for (int i = 0; i < 8; ++i) decisions[random.below(200)] = false;
    soup::RangeEncoder encoder;
    std::vector<soup::Chance> written(7), read(7);
    for (std::size_t i = 0; i < decisions.size(); ++i) encoder.code(written[i % 7], decisions[i]);
    const std::vector<std::byte> bytes = encoder.finish();
    soup::RangeDecoder decoder(bytes);
    for (std::size_t i = 0; i < decisions.size(); ++i) REQUIRE(decoder.decision(read[i % 7]) == decisions[i]);
  }
}

TEST_CASE("lattices are decoded unchanged, for any steps", "[lattice_code]") {
  for (std::uint32_t bits = 1; bits <= 8; ++bits) {
    CAPTURE(bits);
    CodedTextures textures = noisy_textures(50, bits % 2 ? 255 : 20, bits);
    const soup::TextureSteps steps = soup::texture_steps(bits);
    soup::round_textures(textures.values, textures.table, steps);
    const std::vector<std::byte> bytes = soup::encode_lattices(textures.values, textures.table, steps);
    const soup::Lattices again = soup::decode_lattices(bytes, textures.table.size(), steps, "x");
    CHECK(again.values == textures.values);
    for (std::size_t t = 0; t < textures.table.size(); ++t) CHECK(again.levels[t] == textures.table[t].level_max);
  }
}

TEST_CASE("the size of textures follows from their noise", "[lattice_code]") {
  const auto bits_a_value = [](std::uint32_t noise) {
    const CodedTextures textures = noisy_textures(400, noise, 4);
    return 8.0 * double(soup::encode_lattices(textures.values, textures.table, soup::kExactTextures).size()) /
           double(textures.values.size());
  };
  CHECK(bits_a_value(0) < 0.02);
  // The difference to the mean of two samples has 1.5 times the variance of a sample.
  CHECK(bits_a_value(7) < 3.6);
  CHECK(bits_a_value(7) > 3.0);
}

TEST_CASE("values that the steps cannot represent and truncated bytes are refused", "[lattice_code]") {
  const CodedTextures textures = noisy_textures(30, 255, 7);
  CHECK_THROWS_WITH(soup::encode_lattices(textures.values, textures.table, soup::texture_steps(6)),
                    Contains("round its textures"));
  const std::vector<std::byte> bytes = soup::encode_lattices(textures.values, textures.table, soup::kExactTextures);
  for (std::size_t n = 0; n < bytes.size() - 8; n += 1 + bytes.size() / 50)
    CHECK_THROWS_WITH(
        soup::decode_lattices(std::span(bytes).first(n), textures.table.size(), soup::kExactTextures, "x.glb"),
        Contains("x.glb") && Contains("truncated"));
  CHECK_THROWS_WITH(soup::decode_lattices(bytes, 1u << 30, soup::kExactTextures, "x.glb"), Contains("truncated"));
}
