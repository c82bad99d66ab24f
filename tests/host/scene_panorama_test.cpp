// Tests engine/scene/lens/panorama.h, and loading of panoramas.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include "scene/lens/panorama.h"
#include "scene/lens/sample.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

// A smooth colour for a direction in the camera axes of the panorama.
glm::dvec3 sky(glm::dvec3 direction) { return 127.5 + 100.0 * glm::normalize(direction); }

Image panorama_image(int width, int height) {
  Image image{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double longitude = 2 * std::numbers::pi * ((x + 0.5) / width - 0.5);
      const double latitude = std::numbers::pi * ((y + 0.5) / height - 0.5);
      const glm::dvec3 colour =
          sky({std::cos(latitude) * std::sin(longitude), std::sin(latitude), std::cos(latitude) * std::cos(longitude)});
      for (int c = 0; c < 3; ++c) image.rgba.push_back(static_cast<std::uint8_t>(std::lround(colour[c])));
      image.rgba.push_back(255);
    }
  return image;
}

std::string panoramas_of(const std::vector<std::string>& paths) {
  std::string text;
  for (std::size_t i = 0; i < paths.size(); ++i)
    text += fmt::format("{}{{\"file_path\": \"{}\", \"transform_matrix\": [[1,0,0,{}],[0,1,0,0],[0,0,1,0]]}}",
                        i > 0 ? "," : "", paths[i], i);
  return "\"frames\": [" + text + "]}";
}

}  // namespace

TEST_CASE("the faces of a panorama show the directions of their cameras", "[scene][panorama]") {
  const Photograph photograph = from_coverage(panorama_image(128, 64));
  Camera panorama = panorama_camera(128, 64);
  for (std::size_t f = 0; f < 6; ++f) {
    INFO(cube_faces()[f].name);
    CHECK(glm::determinant(cube_faces()[f].panorama_from_face) == Approx(1));
    const Camera camera = face_camera(panorama, f);
    REQUIRE(camera.width == 32);
    const Photograph face = cut_face(photograph, panorama, f);
    REQUIRE(face.pixels() == 32 * 32);
    CHECK(face.inside.empty());
    const glm::dmat3 panorama_from_camera = glm::transpose(glm::dmat3(camera.world_to_camera));
    double worst = 0;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1);
        const glm::dvec3 expected = sky(panorama_from_camera * ray);
        for (int c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(face.colour[std::size_t(32 * y + x)][c] - expected[c]));
      }
    CHECK(worst < 2.5);  // of 255, by rounding and by bilinear interpolation
  }
}

TEST_CASE("a panorama continues at its other border, other photographs repeat theirs", "[scene][panorama]") {
  const Photograph row{4, 1, {{10, 0, 0, 255}, {20, 0, 0, 255}, {30, 0, 0, 255}, {40, 0, 0, 255}}, {}};
  const auto red = [&](Border border, double x) {
    return int(resample(row, 1, 1, border, [&](int, int) { return std::optional(glm::dvec2(x, 0.5)); }).colour[0].r);
  };
  CHECK(red(Border::wrapped, 0) == 25);
  CHECK(red(Border::wrapped, 4) == 25);
  CHECK(red(Border::wrapped, -0.5) == 40);
  CHECK(red(Border::wrapped, 5.5) == 20);
  CHECK(red(Border::clamped, 0) == 10);
  CHECK(red(Border::clamped, 4) == 40);
}

TEST_CASE("a face mixes both sides of the seam", "[scene][panorama]") {
  Photograph photograph = from_coverage(panorama_image(128, 64));
  for (std::size_t i = 0; i < photograph.pixels(); ++i)
    photograph.colour[i].r = i % 128 == 0 ? 200 : i % 128 == 127 ? 100 : 0;
  Camera camera = panorama_camera(128, 64);
  camera.cx = 64.3;  // moves the seam off the middle of the face: a pixel samples column 127.66 - 0.5
  const Photograph back = cut_face(photograph, camera, 0);
  std::uint8_t most = 0;
  for (std::size_t x = 0; x < 32; ++x) most = std::max(most, back.colour[16 * 32 + x].r);
  CHECK(int(most) == 116);  // 0.836 of 100 and 0.164 of 200
}

TEST_CASE("the face towards a direction has it in its image", "[scene][panorama]") {
  for (const glm::dvec3 direction :
       {glm::dvec3(0.2, 0.1, 1), {1, 0.5, -0.7}, {-1, 0, 0.9}, {0, 1, 0.5}, {0.1, -1, 0}, {0.3, 0.2, -1}}) {
    const glm::dmat3 face_from_panorama = glm::transpose(cube_faces()[face_towards(direction)].panorama_from_face);
    const glm::dvec3 ray = face_from_panorama * direction;
    CHECK(ray.z > 0);
    CHECK(std::abs(ray.x) <= ray.z);
    CHECK(std::abs(ray.y) <= ray.z);
  }
}

TEST_CASE("pixels that a mask excludes are excluded across the border of a panorama", "[scene][panorama]") {
  Photograph photograph = from_coverage(panorama_image(128, 64));
  photograph.inside.assign(photograph.pixels(), 255);
  for (std::size_t i = 0; i < photograph.pixels(); ++i)
    if (i % 128 == 0 || i % 128 == 127) photograph.inside[i] = 0;
  const Photograph back = cut_face(photograph, panorama_camera(128, 64), 0);
  REQUIRE(back.inside.size() == 32 * 32);
  CHECK(back.inside[16 * 32 + 15] == 0);  // both sides of the seam
  CHECK(back.inside[16 * 32 + 16] == 0);
  CHECK(back.inside[16 * 32 + 10] == 255);
}

TEST_CASE("a panorama loads as six views that stay together in the test split", "[scene][panorama][load]") {
  const test::SceneFolder folder;
  const std::vector<std::string> names{"a.png", "b.png", "c.png", "d.png"};
  for (const std::string& name : names) folder.write(name, panorama_image(64, 32));
  folder.write("transforms.json", "{\"camera_model\": \"EQUIRECTANGULAR\"," + panoramas_of(names));
  LoadOptions options;
  options.test_every = 2;
  const Scene scene = load(folder.path(), options);
  REQUIRE(scene.train.size() == 12);
  REQUIRE(scene.test.size() == 12);
  CHECK(scene.train[0].name == "b.png/back");
  CHECK(scene.train[5].name == "b.png/up");
  CHECK(scene.train[6].name == "d.png/back");
  CHECK(scene.train[2].camera.width == 16);
  CHECK(scene.train[2].image.width == 16);
  CHECK(
      scene.summary ==
      "transforms.json, 4 photographs of 64 x 32 pixels; 1 EQUIRECTANGULAR camera, panoramas cut into six faces each");
  // The front face looks along the panorama's axis (-z of the OpenGL pose), and all share its centre.
  CHECK(glm::distance(scene.train[2].camera.forward(), glm::dvec3(0, 0, -1)) < 1e-12);
  for (std::size_t i = 1; i < 6; ++i)
    CHECK(glm::distance(scene.train[i].camera.centre(), scene.train[0].camera.centre()) < 1e-12);
  // Up is up: the face shows the panorama's top, whose green is low.
  CHECK(int(scene.train[5].image.rgba[4 * (8 * 16 + 8) + 1]) < 40);
  CHECK(int(scene.train[1].image.rgba[4 * (8 * 16 + 8) + 1]) > 215);

  options.downscale = 2;
  CHECK(load(folder.path(), options).train[0].camera.width == 8);
}

TEST_CASE("points of a COLMAP model are seen by the face that shows them", "[scene][panorama][load]") {
  const test::SceneFolder folder;
  for (const char* name : {"a.png", "b.png"}) folder.write(std::string("images/") + name, panorama_image(64, 32));
  folder.write("sparse/0/cameras.txt", std::string("1 EQUIRECTANGULAR 64 32 64 32\n"));
  folder.write("sparse/0/images.txt", std::string("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 1 b.png\n\n"));
  folder.write("sparse/0/points3D.txt", std::string("1 5 0 0 255 0 0 0.1 1 0 2 0\n2 0 0 4 9 9 9 0.1 2 0\n"));
  LoadOptions options;
  options.test_every = 0;
  const Scene scene = load(folder.path(), options);
  REQUIRE(scene.train.size() == 12);
  REQUIRE(scene.points.seen_by.size() == 2);
  std::vector<std::string> seen;
  for (const auto& views : scene.points.seen_by)
    for (const std::uint32_t v : views) seen.push_back(scene.train[v].name);
  CHECK(seen == std::vector<std::string>{"images/a.png/right", "images/b.png/right", "images/b.png/front"});
}

TEST_CASE("a panorama by its model but not by its picture is reported", "[scene][panorama][load]") {
  const test::SceneFolder folder;
  for (const char* name : {"a.png", "b.png"}) folder.write(name, panorama_image(64, 48));
  std::vector<std::string> lines;
  LoadOptions options;
  options.test_every = 0;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  folder.write("transforms.json", "{\"camera_model\": \"EQUIRECTANGULAR\"," + panoramas_of({"a.png", "b.png"}));
  CHECK(load(folder.path(), options).train.size() == 12);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("panorama a.png of 64 x 48 pixels is not twice as wide as high, but is taken as 360 x 180 ") !=
        std::string::npos);
  folder.write("transforms.json", "{\"latlong\": true, \"fl_x\": 60," + panoramas_of({"a.png", "b.png"}));
  CHECK(test::message_of([&] { load(folder.path(), options); })
            .find("is a panorama of 360 x 180 degrees by its camera model, but has 64 x 48 pixels and a focal length "
                  "of 60 pixels; ") != std::string::npos);
  // Whole panoramas have focal lengths in instant-ngp and nerfstudio.
  for (const char* name : {"a.png", "b.png"}) folder.write(name, panorama_image(64, 32));
  lines.clear();
  CHECK(load(folder.path(), options).train.size() == 12);
  CHECK(lines.empty());
}
