// Tests engine/train/quality/view_exposures.h, and that model files keep exposures.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "format/model_file.h"
#include "soup/random.h"
#include "soup/texture_table.h"
#include "train/quality/view_exposures.h"

using namespace trisoup;

namespace {

/// A photograph from a circle of radius 1 around the origin, at `turn` of the way round, of 60 x 40 pixels.
scene::View view_at(const std::string& name, double turn, double focal = 50) {
  scene::View view;
  view.name = name;
  view.camera.width = 60, view.camera.height = 40;
  view.camera.fx = view.camera.fy = focal;
  const double angle = 6.283185307179586 * turn;
  const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
  view.camera.world_to_camera =
      glm::inverse(glm::dmat4(glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(-z, 1)));
  return view;
}

struct Training {
  std::vector<scene::View> views;
  std::vector<soup::ExposureGrid> gains;
  void add(const scene::View& view, const glm::vec3& gain) {
    views.push_back(view);
    gains.push_back(soup::even_exposure(gain));
  }
  train::ViewExposures exposures() const { return train::ViewExposures(train::photograph_exposures(views, gains)); }
};

glm::vec3 smooth(double turn) {
  const auto a = static_cast<float>(6.283185307179586 * turn);
  return {0.5f * std::sin(a), 0.3f * std::cos(a), -0.2f * std::sin(2 * a)};
}

}  // namespace

TEST_CASE("a photograph's exposure is foretold from those of its neighbours", "[exposure]") {
  Training ring;
  for (int i = 0; i < 40; ++i) ring.add(view_at(std::to_string(i), i / 40.0), smooth(i / 40.0));
  const train::ViewExposures exposures = ring.exposures();
  for (const double turn : {0.0125, 0.3, 0.7131}) {
    const glm::vec3 gain = exposures.at(view_at("test", turn))[4], expected = smooth(turn);
    for (int c = 0; c < 3; ++c) CHECK(gain[c] == Approx(expected[c]).margin(0.03));
    // Folders of training and test views are no different cameras.
    CHECK(exposures.at(view_at("test/0", turn))[4] == gain);
    CHECK(exposures.at(view_at("test/zoomed", turn, 80))[4] == glm::vec3(0));
  }
}

TEST_CASE("exposures that neighbours do not share are foretold as their mean", "[exposure]") {
  soup::Random r(4);
  double squares = 0;
  constexpr int kRings = 20;
  for (int ring_number = 0; ring_number < kRings; ++ring_number) {
    Training ring;
    glm::vec3 mean(0);
    for (int i = 0; i < 24; ++i) {
      ring.add(view_at(std::to_string(i), i / 24.0), glm::vec3(r.uniform01() < 0.5 ? -0.5f : 0.5f));
      mean += ring.gains.back()[4] / 24.0f;
    }
    // Beside a photograph, whose gain is chance.
    const float beyond = ring.exposures().at(view_at("test", 5.02 / 24))[4].r - mean.r;
    squares += beyond * beyond / kRings;
  }
  CHECK(std::sqrt(squares) < 0.25);  // 0.5: what a copy of the neighbour's would have
}

TEST_CASE("a training photograph has its own exposure", "[exposure]") {
  Training ring;
  for (int i = 0; i < 8; ++i) ring.add(view_at(std::to_string(i), i / 8.0), glm::vec3(i % 2 ? -0.5f : 0.5f));
  CHECK(ring.exposures().at(ring.views[3])[4] == glm::vec3(-0.5f));
}

TEST_CASE("faces of panoramas are of one camera, and views from one place differ by direction", "[exposure]") {
  Training panoramas;
  for (int i = 0; i < 12; ++i) {
    scene::View view = view_at("images/" + std::to_string(i / 4) + ".jpg/face", i / 12.0);
    view.camera.world_to_camera[3] = glm::dvec4(0, 0, 0, 1);
    panoramas.add(view, smooth(i / 12.0));
  }
  scene::View view = view_at("images/9.jpg/face", 0.3);
  view.camera.world_to_camera[3] = glm::dvec4(0, 0, 0, 1);
  const glm::vec3 gain = panoramas.exposures().at(view)[4];
  for (int c = 0; c < 2; ++c) CHECK(gain[c] == Approx(smooth(0.3)[c]).margin(0.1));
}

TEST_CASE("cameras have exposures of their own", "[exposure]") {
  Training two;
  for (int i = 0; i < 12; ++i) {
    const bool dark = i >= 8;
    two.add(view_at((dark ? "images/b/" : "images/a/") + std::to_string(i), i / 12.0),
            glm::vec3(dark ? -0.8f : 0.4f, 0, 0));
  }
  CHECK(train::cameras_of(two.views) == std::vector<std::uint32_t>{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1});
  const train::ViewExposures exposures = two.exposures();
  CHECK(exposures.at(view_at("images/a/test.jpg", 0.9))[4].r == Approx(0.4f));
  CHECK(exposures.at(view_at("images/b/test.jpg", 0.1))[4].r == Approx(-0.8f));
  CHECK(exposures.at(view_at("images/b/focused.jpg", 0.1, 52))[4].r == Approx(-0.8f));
  // The same camera in the other orientation, or in smaller photographs.
  scene::View other = view_at("images/b/portrait.jpg", 0.1);
  std::swap(other.camera.width, other.camera.height);
  CHECK(exposures.at(other)[4].r == Approx(-0.8f));
  other = view_at("images/b/small.jpg", 0.1, 25);
  other.camera.width = 30, other.camera.height = 20;
  CHECK(exposures.at(other)[4].r == Approx(-0.8f));
  // No training photograph is by these.
  CHECK(exposures.at(view_at("images/c/other.jpg", 0.1))[4] == glm::vec3(0));
  CHECK(exposures.at(view_at("images/b/zoomed.jpg", 0.1, 80))[4] == glm::vec3(0));
  other = view_at("images/b/square.jpg", 0.1);
  other.camera.width = 40;
  CHECK(exposures.at(other)[4] == glm::vec3(0));
}

TEST_CASE("means of cameras shrink if photographs of one camera differ as much", "[exposure]") {
  soup::Random r(2);
  Training two;
  float mean = 0;
  for (int i = 0; i < 12; ++i) {
    const bool dark = i >= 8;
    const float gain = (dark ? -0.4f : 0.2f) + static_cast<float>(r.uniform(-1.8, 1.8));
    two.add(view_at((dark ? "b/" : "a/") + std::to_string(i), r.uniform01()), glm::vec3(gain));
    if (dark) mean += gain / 4;
  }
  const train::ViewExposures exposures = two.exposures();
  float foretold = 0;
  for (int i = 0; i < 16; ++i) foretold += exposures.at(view_at("b/test", i / 16.0))[4].r / 16;
  CAPTURE(mean, foretold);
  CHECK(std::abs(foretold) < 0.7f * std::abs(mean));
}

TEST_CASE("photographs without differences have no exposures", "[exposure]") {
  Training ring;
  for (int i = 0; i < 4; ++i) ring.add(view_at(std::to_string(i), i / 4.0), glm::vec3(0));
  CHECK(train::photograph_exposures(ring.views, ring.gains).empty());
  CHECK(train::photograph_exposures(ring.views, {}).empty());
  CHECK(ring.exposures().empty());
  CHECK(train::ViewExposures().at(view_at("test", 0.3)) == soup::ExposureGrid());
}

TEST_CASE("an exposure changes all of a picture but its background", "[exposure]") {
  std::vector<float> colour{0, 0, 0, 0.5f, 0.5f, 1};
  train::expose(colour, 2, 1, soup::even_exposure(glm::vec3(std::log(3.0f), -std::log(3.0f), 2)), glm::vec3(0));
  CHECK(colour[0] == 0);
  CHECK(colour[3] == Approx(0.75f));
  CHECK(colour[4] == Approx(0.25f));
  CHECK(colour[5] == 1);
}

TEST_CASE("a model file keeps the exposures of its training views", "[exposure][model]") {
  soup::Model model;
  model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.textures = soup::make_texture_table(1, soup::TextureLevels{0, 0}).entries;
  model.lattice.assign(std::size_t(soup::samples_at(0)) * soup::kChannels, 7);
  model.scale = 2, model.centre = {1, 2, 3};
  soup::ModelFileOptions options;
  Training ring;
  for (int i = 0; i < 6; ++i) {
    ring.add(view_at("images/" + std::to_string(i), i / 6.0), smooth(i / 6.0));
    for (int k = 0; k < 25; ++k) ring.gains.back()[std::size_t(k)].y += 0.01f * float(k);
  }
  options.cameras.push_back({"images/t", true, view_at("images/t", 0.4).camera});
  for (const scene::View& view : ring.views) options.cameras.push_back({view.name, false, view.camera});
  options.cameras.push_back({"images/held_out", false, view_at("images/held_out", 0.7).camera});
  const auto read_back = [&] {
    return soup::decode_model(soup::encode_model(model, options), "model").model.exposures;
  };
  CHECK(read_back().empty());
  model.exposures = train::photograph_exposures(ring.views, ring.gains);
  const auto again = read_back();
  REQUIRE(again.size() == 6);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(again[i].name == ring.views[i].name);
    CHECK(again[i].gain == ring.gains[i]);
    CHECK(again[i].focal == Approx(model.exposures[i].focal));
    CHECK(glm::distance(again[i].position, model.exposures[i].position) < 1e-6);
    CHECK(glm::distance(again[i].direction, model.exposures[i].direction) < 1e-6);
  }
  std::vector<std::byte> bytes = soup::encode_model(model, options);
  const float whole = ring.gains[2][7].y;
  const auto* const first = reinterpret_cast<const std::byte*>(&whole);
  const auto place = std::search(bytes.begin(), bytes.end(), first, first + sizeof(whole));
  REQUIRE(place != bytes.end());
  for (const float damage : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), 50.0f}) {
    std::memcpy(&*place, &damage, sizeof(damage));
    CHECK_THROWS_WITH(soup::decode_model(bytes, "model"), Catch::Contains("model: an exposure is not a number or too"));
  }
  // A training that went astray still writes a file that can be read.
  const glm::vec3 kept = std::exchange(model.exposures[2].gain[8], glm::vec3(1000, -1000, 0));
  CHECK(read_back()[2].gain[8] == glm::vec3(5, -5, 0));
  model.exposures[2].gain[8] = kept;
  // Views in other coordinates than the model's.
  const scene::Normalisation other{{0, 0, 0}, 1};
  scene::View view = view_at("images/x", 0.4);
  const glm::vec3 here = train::ViewExposures(model, {model.centre, model.scale}).at(view)[4];
  const glm::dvec3 world = scene::Normalisation{model.centre, model.scale}.to_world(view.camera.centre());
  view.camera.world_to_camera[3] = glm::dvec4(-(glm::dmat3(view.camera.world_to_camera) * world), 1);
  const glm::vec3 there = train::ViewExposures(model, other).at(view)[4];
  for (int c = 0; c < 3; ++c) CHECK(there[c] == Approx(here[c]).margin(1e-4));
  CHECK(train::gains_of(model, {ring.views[4], view_at("other", 0)}) ==
        std::vector<soup::ExposureGrid>{ring.gains[4], {}});
}

TEST_CASE("a photograph beside the model is what exposing the model would make of it, undone") {
  Image photograph{256, 1, {}};
  for (int i = 0; i < 256; ++i)
    for (const int value : {i, 255 - i, i, i / 2}) photograph.rgba.push_back(static_cast<std::uint8_t>(value));
  const soup::ExposureGrid gain = soup::even_exposure(glm::vec3(0.4f, -0.7f, 0));
  const Image shown = train::in_scene_exposure(photograph, gain);
  REQUIRE(shown.rgba.size() == photograph.rgba.size());
  std::vector<float> colour;
  for (std::size_t i = 0; i < shown.rgba.size(); ++i) {
    if (i % 4 == 3)
      CHECK(shown.rgba[i] == photograph.rgba[i]);
    else
      colour.push_back(static_cast<float>(shown.rgba[i]) / 255.0f);
  }
  CHECK(shown.rgba[4 * 128] < 128);      // its red was brightened
  CHECK(shown.rgba[4 * 128 + 1] > 127);  // its green was darkened
  CHECK(shown.rgba[4 * 255] == 255);
  train::expose(colour, 256, 1, gain, glm::vec3(-1));
  for (std::size_t i = 0; i < 256; ++i)
    for (std::size_t c = 0; c < 3; ++c) CHECK(std::abs(255 * colour[3 * i + c] - photograph.rgba[4 * i + c]) < 1.1f);
  CHECK(train::in_scene_exposure(photograph, {}).rgba == photograph.rgba);
}

TEST_CASE("gains lie bilinearly between the places of a picture, from its corners", "[exposure]") {
  soup::ExposureGrid grid;
  for (int k = 0; k < 25; ++k) grid[std::size_t(k)] = glm::vec3(k % 5 * (k % 5), k / 5 * (k / 5), k % 5 * (k / 5));
  const auto squared = [](double at) {  // linear between the squares of whole numbers
    const double whole = std::floor(at);
    return whole * whole + (at - whole) * (2 * whole + 1);
  };
  const std::vector<glm::vec3> gains = train::gains_at_pixels(grid, 16, 6);
  REQUIRE(gains.size() == 96);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 16; ++x) {
      const double u = 4 * (x + 0.5) / 16, v = 4 * (y + 0.5) / 6;
      const glm::vec3 gain = gains[std::size_t(16 * y + x)];
      CHECK(gain.x == Approx(squared(u)));
      CHECK(gain.y == Approx(squared(v)));
      CHECK(gain.z == Approx(u * v));
    }
}

TEST_CASE("models with fewer gains of a photograph are read", "[exposure][model]") {
  soup::Model model;
  model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.textures = soup::make_texture_table(1, soup::TextureLevels{0, 0}).entries;
  model.lattice.assign(std::size_t(soup::samples_at(0)) * soup::kChannels, 7);
  Training one;
  one.add(view_at("a", 0), glm::vec3(0));
  for (std::size_t k = 0; k < 25; ++k) one.gains[0][k] = glm::vec3(0.1f * float(k), 0, 0);
  model.exposures = train::photograph_exposures(one.views, one.gains);
  soup::ModelFileOptions options;
  options.cameras.push_back({"a", false, one.views[0].camera});
  const auto read_with = [&](const std::string& bytes_of_gains) {
    const std::vector<std::byte> bytes = soup::encode_model(model, options);
    std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const std::string length = "\"byteLength\":300";
    REQUIRE(text.find(length) != std::string::npos);
    text.replace(text.find(length), length.size(), "\"byteLength\":" + bytes_of_gains);
    const auto* const first = reinterpret_cast<const std::byte*>(text.data());
    return soup::decode_model(std::vector<std::byte>(first, first + text.size()), "model").model.exposures[0].gain;
  };
  const soup::ExposureGrid nine = read_with("108"), single = read_with(" 12");
  for (std::size_t k = 0; k < 25; ++k) {  // gain 0.1 k at place k of 3 x 3 is linear along both sides
    CHECK(nine[k].x == Approx(0.05f * float(k % 5) + 0.15f * float(k / 5)).margin(1e-6));
    CHECK(single[k].x == 0);
  }
  CHECK_THROWS_WITH(read_with(" 24"), Catch::Contains("numbers of exposures and cameras differ"));
}

TEST_CASE("what lenses and shadows do to parts of a picture is foretold, too", "[exposure]") {
  Training ring;
  const auto gain_of = [](double turn, std::size_t place) {
    return glm::vec3(place == 12 ? 0.2f : -0.1f) + (place == 17 ? smooth(turn) : glm::vec3(0));
  };
  for (int i = 0; i < 40; ++i) {
    ring.add(view_at(std::to_string(i), i / 40.0), glm::vec3(0));
    for (std::size_t k = 0; k < 25; ++k) ring.gains.back()[k] = gain_of(i / 40.0, k);
  }
  const soup::ExposureGrid foretold = ring.exposures().at(view_at("test", 0.3));
  for (std::size_t k = 0; k < 25; ++k)
    for (int c = 0; c < 3; ++c) CHECK(foretold[k][c] == Approx(gain_of(0.3, k)[c]).margin(0.03));
}
