// Tests engine/soup/colour_fit.cpp with pictures whose best colours are known.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

#include "common/host.h"
#include "image/srgb.h"
#include "soup/atlas.h"
#include "soup/colour_fit.h"
#include "soup/random.h"
#include "soup/texture_table.h"

using namespace trisoup;

namespace {

/// Triangles in the plane z = 0 with one texture level. mix: share of the MLP, 0..255.
soup::Model flat_triangles(std::uint32_t triangles, std::uint32_t level, std::uint8_t mix, std::uint64_t seed) {
  soup::Random random(seed);
  soup::Model model;
  for (std::uint32_t t = 0; t < triangles; ++t)
    for (const glm::vec2 corner : {glm::vec2(0, 0), {1, 0}, {0, 1}}) model.vertices.emplace_back(corner, 0.0f);
  model.textures = soup::make_texture_table(triangles, soup::TextureLevels{level, level}).entries;
  for (std::uint32_t s = 0; s < triangles * soup::samples_at(level); ++s)
    for (int c = 0; c < soup::kChannels; ++c)
      model.lattice.push_back(c == 3 ? mix : c == 7 ? std::uint8_t(255) : static_cast<std::uint8_t>(random.bits()));
  for (float& weight : model.mlp.parameters) weight = 2 * random.uniform01() - 1;
  return model;
}

/// Pixels of a picture, and their colours.
struct FlatPicture {
  std::vector<kernels::Hit> hits;
  std::vector<float> colours;

  void add(std::uint32_t triangle, float b0, float b1, const glm::vec3& colour) {
    hits.push_back({triangle + 1, b0, b1, 0});
    colours.insert(colours.end(), {colour.r, colour.g, colour.b});
  }
  /// `side` rows of pixels of one colour.
  void fill(std::uint32_t triangle, int side, const glm::vec3& colour) {
    for (int y = 0; y < side; ++y)
      for (int x = 0; x + y < side; ++x)
        add(triangle, (float(x) + 0.3f) / float(side), (float(y) + 0.3f) / float(side), colour);
  }
};

std::vector<std::uint8_t> fitted(const soup::Model& model, const std::vector<glm::vec3>& eyes,
                                 const std::vector<FlatPicture>& pictures) {
  soup::ColourFit fit(model, eyes);
  for (int solution = 0; solution < 2; ++solution) {
    for (std::uint32_t view = 0; view < pictures.size(); ++view)
      fit.add(view, pictures[view].hits, pictures[view].colours);
    fit.solve();
  }
  return fit.colours();
}

/// The colour of a sample from a direction, in double precision.
glm::dvec3 shaded(const soup::Model& model, std::size_t sample, const glm::dvec3& towards) {
  const std::vector<double> weights(model.mlp.parameters.begin(), model.mlp.parameters.end());
  double in[16], h1[16], h2[16], out[3];
  for (std::size_t c = 0; c < 7; ++c) in[c] = model.lattice[sample * soup::kChannels + c] / 255.0;
  f64::spherical_harmonics(glm::normalize(towards), in + 7);
  f64::mlp_forward(weights.data(), in, h1, h2, out);
  return f64::skip_connection(in, {out[0], out[1], out[2]});
}

}  // namespace

TEST_CASE("the colours with which a viewer drew a picture are found", "[colour_fit]") {
  const std::uint32_t level = GENERATE(0u, 1u, 3u);
  const soup::Model model = flat_triangles(2, level, 0, 7);
  const std::uint32_t samples = soup::samples_at(level);
  soup::Random random(8);
  std::vector<glm::vec3> truth, light;
  for (std::uint32_t s = 0; s < samples; ++s) {
    const auto value = [&] { return random.uniform(0.35, 0.65); };
    truth.emplace_back(value(), value(), value());
    light.emplace_back(light_of_srgb(truth[s].r), light_of_srgb(truth[s].g), light_of_srgb(truth[s].b));
  }
  FlatPicture picture;
  for (int i = 0; i < 200'000; ++i) {
    const float b0 = random.uniform01(), b1 = random.uniform01();
    if (b0 + b1 > 1) continue;
    const glm::vec3 shown = soup::AtlasWeights(b0, b1, level).mix(light.data());
    picture.add(0, b0, b1, {srgb_of_light(shown.r), srgb_of_light(shown.g), srgb_of_light(shown.b)});
  }
  const auto colours = fitted(model, {{0, 0, 1}}, {picture});
  REQUIRE(colours.size() == 2 * samples * 3);
  double squares = 0;
  for (std::uint32_t i = 0; i < 3 * samples; ++i) squares += std::pow(colours[i] - 255 * truth[i / 3][i % 3], 2);
  CHECK(std::sqrt(squares / (3 * samples)) < 0.6);
  // No picture shows the second triangle, and its colours do not depend on the direction.
  for (std::uint32_t s = samples; s < 2 * samples; ++s)
    for (std::uint32_t c = 0; c < 3; ++c) CHECK(colours[3 * s + c] == model.lattice[s * soup::kChannels + c]);
}

TEST_CASE("views count by their pixels", "[colour_fit]") {
  const soup::Model model = flat_triangles(1, 2, 0, 9);
  FlatPicture near, far;
  near.fill(0, 480, {0.2f, 0.9f, 0});
  far.fill(0, 277, {0.6f, 0.1f, 0});
  const auto colours = fitted(model, {{0, 0, 1}, {0, 0, 2}}, {near, far});
  const double share = 277.0 * 278 / (277 * 278 + 480 * 481);
  for (std::size_t s = 0; s < colours.size() / 3; ++s) {
    CAPTURE(s);
    CHECK(std::abs(colours[3 * s] - 255 * (0.2 + 0.4 * share)) < 2);
    CHECK(std::abs(colours[3 * s + 1] - 255 * (0.9 - 0.8 * share)) < 3);
  }
}

TEST_CASE("samples without pixels have the colours of the views that show their triangle", "[colour_fit]") {
  const soup::Model model = flat_triangles(1, 3, 255, 10);
  const std::vector<glm::vec3> eyes{{9, 0, 1}, {-9, 2, 4}};
  // The second view shows the triangle in one pixel, with the MLP's colour of the sample there.
  FlatPicture pixel;
  const std::uint32_t corner = f32::lattice_index(0, 0);
  pixel.add(0, 0, 0, glm::vec3(shaded(model, corner, glm::dvec3(eyes[1] - model.vertices[2]))));
  const auto colours = fitted(model, eyes, {{}, pixel});
  soup::each_lattice_point(3, [&](int x, int y, std::uint32_t index) {
    const glm::vec3 at =
        (float(x) * model.vertices[0] + float(y) * model.vertices[1] + float(8 - x - y) * model.vertices[2]) / 8.0f;
    const glm::dvec3 expected = shaded(model, index, glm::dvec3(eyes[1] - at));
    for (std::uint32_t c = 0; c < 3; ++c) CHECK(std::abs(colours[3 * index + c] - 255 * expected[int(c)]) < 0.6);
  });
}

TEST_CASE("hidden triangles have the mean colour over the views", "[colour_fit]") {
  const soup::Model model = flat_triangles(1, 0, 255, 11);
  const std::vector<glm::vec3> eyes{{9, 0, 1}, {-9, 2, 4}};
  const auto colours = fitted(model, eyes, {{}, {}});
  const std::uint32_t corner = f32::lattice_index(0, 0);
  glm::dvec3 mean(0.0);
  for (const glm::vec3& eye : eyes) mean += 0.5 * shaded(model, corner, glm::dvec3(eye - model.vertices[2]));
  for (std::uint32_t c = 0; c < 3; ++c) CHECK(std::abs(colours[3 * corner + c] - 255 * mean[int(c)]) < 0.6);
}
