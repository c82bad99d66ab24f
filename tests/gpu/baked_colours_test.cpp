// Tests engine/train/quality/baked_colours.h: colours of a wall whose colour depends on the direction, seen by cameras
// and hidden from others.
#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "gpu/out_of_memory.h"
#include "gpu/small_scene.h"
#include "soup/bake.h"
#include "train/quality/baked_colours.h"
#include "train/quality/evaluate.h"

using namespace trisoup;

namespace {

constexpr int kBakedViewSide = 48;
constexpr double kBakedNear = 0.025, kBakedFar = 20;

/// Looks along +z from an eye.
scene::Camera baked_camera(const glm::dvec3& eye) {
  scene::Camera camera;
  camera.width = camera.height = kBakedViewSide;
  camera.fx = camera.fy = kBakedViewSide;
  camera.cx = camera.cy = kBakedViewSide / 2;
  camera.world_to_camera[3] = glm::dvec4(-eye, 1);
  return camera;
}

/// Opaque squares with half side x in planes of constant z, random features.
soup::Model baked_walls(const std::vector<glm::vec2>& squares) {
  soup::Model model;
  for (const glm::vec2& s : squares)
    for (const glm::vec2 corner : {glm::vec2(-1, -1), {1, -1}, {-1, 1}, {-1, 1}, {1, -1}, {1, 1}})
      model.vertices.emplace_back(s.x * corner, s.y);
  model.textures = soup::make_texture_table(2 * squares.size(), soup::TextureLevels{2, 2}).entries;
  soup::Random random(5);
  for (std::size_t s = 0; s < model.textures.size() * soup::samples_at(2); ++s)
    for (int c = 0; c < soup::kChannels; ++c)
      model.lattice.push_back(c == 3 || c == 7 ? std::uint8_t(255)
                                               : static_cast<std::uint8_t>(96 + random.bits() % 64));
  for (float& weight : model.mlp.parameters) weight = 2 * random.uniform01() - 1;
  return model;
}

std::vector<std::uint8_t> fitted_by(gpu::Device& gpu, const soup::Model& model, const std::vector<glm::dvec3>& eyes,
                                    bool last_is_test = false) {
  std::vector<soup::ModelCamera> cameras;
  for (const glm::dvec3& eye : eyes) cameras.push_back({"c", false, baked_camera(eye)});
  if (last_is_test) cameras.back().test = true;
  return train::fitted_colours(gpu, model, cameras, kBakedNear, kBakedFar);
}

/// The model with these colours and without the MLP.
soup::Model plain_of(soup::Model model, const std::vector<std::uint8_t>& colours) {
  for (std::size_t s = 0; s < colours.size() / 3; ++s) {
    for (std::size_t c = 0; c < 3; ++c) model.lattice[s * soup::kChannels + c] = colours[3 * s + c];
    model.lattice[s * soup::kChannels + 3] = 0;
  }
  return model;
}

/// A view whose photograph is the model's picture.
scene::View photographed(gpu::Device& gpu, const soup::Model& model, const glm::dvec3& eye) {
  scene::Scene scene;
  scene.test = {{"view", baked_camera(eye), {kBakedViewSide, kBakedViewSide, {}}}};
  scene.test[0].image.rgba.assign(4 * kBakedViewSide * kBakedViewSide, 255);
  std::vector<std::uint8_t> picture;
  train::evaluate(gpu, model, scene, scene.test, kBakedNear, kBakedFar,
                  [&](const scene::View&, const std::vector<float>& colour) {
                    for (std::size_t i = 0; i < colour.size(); ++i) {
                      picture.push_back(static_cast<std::uint8_t>(std::lround(255 * colour[i])));
                      if (i % 3 == 2) picture.push_back(255);
                    }
                  });
  scene.test[0].image.rgba = picture;
  return scene.test[0];
}

double psnr_from(gpu::Device& gpu, const soup::Model& model, const std::vector<std::uint8_t>& colours,
                 const glm::dvec3& eye) {
  return *train::baked_psnr(gpu, plain_of(model, colours), {photographed(gpu, model, eye)}, kBakedNear, kBakedFar)
              .at(0);
}

const glm::dvec3 kEyeInFront(0, 0, 0), kEyeAside(1.5, 0.5, 0.5), kEyeBehind(0.4, 0.2, -2);
const glm::vec2 kTheWall(2, 2), kBlocker(4, -1);  // half side, z

}  // namespace

TEST_CASE("baked colours look like the model from the camera that sees it", "[baked][each_driver]") {
  auto gpu = test::open_device();
  const soup::Model model = baked_walls({kTheWall});
  const auto front = fitted_by(*gpu, model, {kEyeInFront}), side = fitted_by(*gpu, model, {kEyeAside}),
             both = fitted_by(*gpu, model, {kEyeInFront, kEyeAside});
  const double own = psnr_from(*gpu, model, front, kEyeInFront), other = psnr_from(*gpu, model, side, kEyeInFront),
               mean = psnr_from(*gpu, model, both, kEyeInFront),
               around = psnr_from(*gpu, model, soup::bake_colours(model, {}), kEyeInFront);
  CAPTURE(own, other, mean, around);
  CHECK(own > 35);
  CHECK(own > mean + 3);
  CHECK(mean > other + 1);
  CHECK(own > around + 10);
  // The colours of both are a compromise that is best for the two pictures together.
  const auto error = [&](const auto& colours) {
    return std::pow(10, -0.1 * psnr_from(*gpu, model, colours, kEyeInFront)) +
           std::pow(10, -0.1 * psnr_from(*gpu, model, colours, kEyeAside));
  };
  CHECK(error(both) < error(front));
  CHECK(error(both) < error(side));
  test::require_silence(*gpu);
}

TEST_CASE("a camera does not count for what others hide from it", "[baked][each_driver]") {
  auto gpu = test::open_device();
  const std::size_t wall = 3 * 2 * soup::samples_at(2);  // values
  const auto of_wall = [&](const std::vector<glm::vec2>& squares, const std::vector<glm::dvec3>& eyes,
                           bool last_is_test = false) {
    auto colours = fitted_by(*gpu, baked_walls(squares), eyes, last_is_test);
    colours.resize(wall);
    return colours;
  };
  // The features of the wall do not depend on the number of walls, the MLP does.
  const auto seen = of_wall({kTheWall, kBlocker}, {kEyeInFront});
  CHECK(of_wall({kTheWall, kBlocker}, {kEyeInFront, kEyeBehind}) == seen);
  CHECK(of_wall({kTheWall, kTheWall + glm::vec2(0, 9)}, {kEyeInFront, kEyeBehind}) !=
        of_wall({kTheWall, kTheWall + glm::vec2(0, 9)}, {kEyeInFront}));
  // Nor do test views.
  CHECK(of_wall({kTheWall}, {kEyeInFront, kEyeAside}, true) == of_wall({kTheWall}, {kEyeInFront}));
}

TEST_CASE("without cameras colours are those of all directions", "[baked]") {
  auto gpu = test::open_device();
  const soup::Model model = baked_walls({kTheWall});
  CHECK(fitted_by(*gpu, model, {}) == soup::bake_colours(model, {}));
}

TEST_CASE("PSNR of baked colours", "[baked][each_driver]") {
  auto gpu = test::open_device();
  soup::Model model = baked_walls({{0.3f, 2}});
  model.background = {0.2f, 0.4f, 0.6f};
  const std::vector<std::uint8_t> grey(model.lattice.size() / soup::kChannels * 3, 102);
  scene::View view = photographed(*gpu, plain_of(model, grey), kEyeInFront);
  const auto measured = [&] {
    return train::baked_psnr(*gpu, plain_of(model, grey), {view}, kBakedNear, kBakedFar).at(0);
  };
  CHECK(*measured() == 100);
  // A difference of 51 steps in one of three channels of a quarter of the pixels: 10 log10(12 x 25) dB.
  for (std::size_t p = 0; p < view.image.rgba.size() / 4; p += 4) view.image.rgba[4 * p + 1] += 51;
  CHECK(*measured() == Approx(10 * std::log10(300)).margin(1e-4));
  // Without those pixels.
  for (std::size_t p = 0; p < view.image.rgba.size() / 4; p += 4) view.image.rgba[4 * p + 3] = 0;
  CHECK(*measured() == 100);
  for (std::size_t p = 0; p < view.image.rgba.size() / 4; ++p) view.image.rgba[4 * p + 3] = 0;
  CHECK_FALSE(measured());
  nlohmann::json json = {{"views", {{{"name", "a"}}, {{"name", "b"}}, {{"name", "c"}}}}};
  train::add_baked(json, std::vector<std::optional<double>>{20.0, {}, 30.0});
  CHECK(json["psnr_baked"] == 25.0);
  CHECK(json["views"][1]["psnr_baked"].is_null());
  CHECK(json["views"][2]["psnr_baked"] == 30.0);
}

TEST_CASE("baked colours without enough device memory are those of eight directions, with a warning", "[baked]") {
  auto gpu = test::open_own_device();
  const soup::Model model = baked_walls({kTheWall});
  const std::vector<soup::ModelCamera> cameras{{"c", false, baked_camera(kEyeInFront)}};
  gpu->set_ceiling(gpu->allocated_bytes() + 1024);
  std::vector<std::string> lines;
  const auto colours = train::fitted_colours(*gpu, model, cameras, kBakedNear, kBakedFar,
                                             [&](const std::string& line) { lines.push_back(line); });
  CHECK(colours == soup::bake_colours(model, {}));
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("eight directions") != std::string::npos);
  CHECK_THROWS_AS(train::fitted_colours(*gpu, model, cameras, kBakedNear, kBakedFar), gpu::OutOfMemory);
}
