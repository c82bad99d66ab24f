// Tests engine/soup/bake.cpp. model_file_test.cpp tests that baked colours follow the MLP.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/host.h"
#include "soup/bake.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

soup::Model samples(std::size_t count, std::uint64_t seed) {
  soup::Random random(seed);
  soup::Model model;
  for (std::size_t i = 0; i < count * soup::kChannels; ++i)
    model.lattice.push_back(static_cast<std::uint8_t>(random.bits()));
  for (float& w : model.mlp.parameters) w = 2 * random.uniform01() - 1;
  return model;
}

/// sigmoid(W3 relu(W2 relu(W1 x + b1) + b2) + b3) with the skip connection, directly from the formula.
glm::dvec3 shade(const soup::Model& model, std::size_t sample, const glm::dvec3& direction) {
  std::vector<double> x;
  for (int c = 0; c < 7; ++c) x.push_back(model.lattice[sample * 8 + c] / 255.0);
  const glm::dvec3 base(x[0], x[1], x[2]);
  const double residual = x[3];
  double harmonics[9];
  f64::spherical_harmonics(direction, harmonics);
  x.insert(x.end(), harmonics, harmonics + 9);
  const float* p = model.mlp.parameters.data();
  const auto layer = [&](const std::vector<double>& in, int outputs) {
    std::vector<double> out(outputs);
    for (int o = 0; o < outputs; ++o)
      for (std::size_t i = 0; i < in.size(); ++i) out[o] += double(p[o * in.size() + i]) * in[i];
    p += outputs * in.size();
    for (int o = 0; o < outputs; ++o) out[o] += double(p[o]);
    p += outputs;
    return out;
  };
  const auto relu = [](std::vector<double> v) {
    for (double& value : v) value = std::max(0.0, value);
    return v;
  };
  x = relu(layer(x, 16));
  x = relu(layer(x, 16));
  x = layer(x, 3);
  glm::dvec3 colour;
  for (int c = 0; c < 3; ++c) colour[c] = (1 - residual) * base[c] + residual / (1 + std::exp(-x[c]));
  return colour;
}

}  // namespace

TEST_CASE("a baked colour equals the formula of the method", "[bake]") {
  const soup::Model model = samples(500, 3);
  const std::vector<glm::vec3> directions{{1, 0, 0}, {0, -1, 0}, glm::normalize(glm::vec3(1, 2, -3))};
  const auto baked = soup::bake_colours(model, directions);
  REQUIRE(baked.size() == 500 * 3);
  for (std::size_t s = 0; s < 500; ++s) {
    glm::dvec3 mean(0);
    for (const glm::vec3& d : directions) mean += shade(model, s, glm::dvec3(d)) / 3.0;
    for (int c = 0; c < 3; ++c) CHECK(std::abs(baked[3 * s + c] - 255 * mean[c]) < 0.5 + 1e-3);
  }
}

TEST_CASE("without directions colours are averaged over eight directions on the sphere", "[bake]") {
  const soup::Model model = samples(50, 4);
  std::vector<glm::vec3> corners;
  for (const float x : {-1.0f, 1.0f})
    for (const float y : {-1.0f, 1.0f})
      for (const float z : {-1.0f, 1.0f}) corners.push_back(glm::normalize(glm::vec3(x, y, z)));
  const auto with = soup::bake_colours(model, corners), without = soup::bake_colours(model, {});
  REQUIRE(with.size() == without.size());
  for (std::size_t i = 0; i < with.size(); ++i)
    CHECK(std::abs(int(with[i]) - int(without[i])) <= 1);  // sums in another order
}

TEST_CASE("a texture that does not use the MLP is baked unchanged", "[bake]") {
  soup::Model model = samples(256, 5);
  for (std::size_t s = 0; s < 256; ++s) model.lattice[s * 8 + 3] = 0;
  const auto baked = soup::bake_colours(model, {});
  for (std::size_t s = 0; s < 256; ++s)
    for (int c = 0; c < 3; ++c) CHECK(baked[3 * s + c] == model.lattice[8 * s + c]);
}

TEST_CASE("few or no samples can be baked", "[bake]") {
  CHECK(soup::bake_colours(soup::Model{}, {}).empty());
  CHECK(soup::bake_colours(samples(1, 6), {}).size() == 3);
}
