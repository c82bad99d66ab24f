// Tests engine/scene/datasets/intrinsics.h: cameras that cannot be those of photographs.
#include <catch2/catch.hpp>

#include <cmath>

#include "scene/datasets/intrinsics.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

Frame frame_of(const std::string& name, const Camera& camera, const Lens& lens = {}) {
  Frame frame;
  frame.source = "images.txt";
  frame.photograph.name = name;
  frame.size = {camera.width, camera.height};
  frame.camera = camera;
  frame.lens = lens;
  frame.model = model_name(lens);
  return frame;
}

Lens radial(double k1, Lens::Model model = Lens::Model::perspective) {
  Lens lens;
  lens.model = model;
  lens.radial[0] = k1;
  return lens;
}

const Camera good{640, 480, 500, 500, 320, 240, glm::dmat4(1.0)};

Camera with_focal(double f) {
  Camera camera = good;
  camera.fx = camera.fy = f;
  return camera;
}

// Checks two good frames with a doubtful one between them. Returns the findings.
std::vector<std::string> lines_with(const Frame& doubtful, std::size_t left) {
  Dataset dataset;
  dataset.frames = {frame_of("a", good), doubtful, frame_of("c", good)};
  dataset.points.seen_by = {{0, 1, 2}};
  check_intrinsics(dataset);
  CHECK(dataset.frames.size() == left);
  CHECK(dataset.frames.back().photograph.name == "c");
  CHECK(dataset.points.seen_by[0].back() == left - 1);
  return dataset.findings.lines();
}

std::string left_out(const Frame& doubtful) {
  const auto lines = lines_with(doubtful, 2);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].starts_with("images.txt: left out 1 photograph: "));
  CHECK(lines[0].ends_with(": b"));
  return lines[0];
}

}  // namespace

TEST_CASE("cameras with an impossible focal length are left out", "[scene][intrinsics]") {
  for (const double f : {1e-4, 30.0, 33000.0, 2e6})
    CHECK(left_out(frame_of("b", with_focal(f))).find("the focal length of b, ") != std::string::npos);
  CHECK(left_out(frame_of("b", with_focal(0.9))).find("if it is a fraction of the width") != std::string::npos);
  CHECK(left_out(frame_of("b", with_focal(24))).find("if it is in millimetres") != std::string::npos);
  for (const double f : {40.0, 31000.0}) {
    const auto lines = lines_with(frame_of("b", with_focal(f)), 3);
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].find(f < 640 ? "which is too short for lenses" : "which is very long for lenses") !=
          std::string::npos);
  }
  for (const double f : {170.0, 9000.0}) CHECK(lines_with(frame_of("b", with_focal(f)), 3).empty());
  CHECK(lines_with(frame_of("b", with_focal(150), radial(0, Lens::Model::fisheye)), 3).empty());
  // A model file holds focal lengths below 1e6 pixels.
  CHECK(left_out(frame_of("b", {30000, 20000, 1.1e6, 1.1e6, 15000, 10000, glm::dmat4(1.0)})).find("1.1e+06 pixels") !=
        std::string::npos);
}

TEST_CASE("normalised intrinsics are left out; all of them are an Error", "[scene][intrinsics]") {
  const Camera normalised{640, 480, 0.9, 1.2, 0.5, 0.5, glm::dmat4(1.0)};
  CHECK(left_out(frame_of("b", normalised)).find("the intrinsics of b are normalised ") != std::string::npos);
  Dataset dataset;
  dataset.frames = {frame_of("a", normalised), frame_of("b", normalised)};
  CHECK(
      test::message_of([&] { check_intrinsics(dataset); }) ==
      "images.txt: the intrinsics of a are normalised (focal length 0.9, principal point 0.5, 0.5); multiply those of "
      "x by the width and those of y by the height");
}

TEST_CASE("lenses that fold over inside the picture are left out, near its border warned of", "[scene][intrinsics]") {
  // r (1 + k1 r^2) has its maximum 2/3 r at r = sqrt(-1 / (3 k1)). The corners of the picture are at r = 0.8.
  CHECK(
      left_out(frame_of("b", good, radial(-2)))
          .find(
              "the lens of b (OPENCV) folds over 136 pixels from its principal point, inside 81 % of its picture; ") !=
      std::string::npos);
  const auto warned = lines_with(frame_of("b", good, radial(-0.53)), 3);
  REQUIRE(warned.size() == 1);
  CHECK(warned[0].starts_with("images.txt: the lens of b (OPENCV) folds over 264 pixels from its principal point; "));
  CHECK(warned[0].ends_with("(1 of 3 photographs)"));
  CHECK(lines_with(frame_of("b", good, radial(-0.5)), 3).empty());  // beyond the corners
  // A wide lens folds over beyond the corners of its undistorted image: the photograph's border is not shown anyway.
  CHECK(lines_with(frame_of("b", with_focal(350), radial(-0.25)), 3).empty());
  CHECK(left_out(frame_of("b", good, radial(61))).find("the distortion of b (OPENCV) is so strong ") !=
        std::string::npos);
  // Fisheyes: an ideal one of 180 degrees whose circle ends inside the picture does not fold.
  const Camera circle{1000, 1000, 300, 300, 500, 500, glm::dmat4(1.0)};
  CHECK(lines_with(frame_of("b", circle, radial(0, Lens::Model::fisheye)), 3).empty());
  CHECK(left_out(frame_of("b", circle, radial(-1, Lens::Model::fisheye))).find("folds over") != std::string::npos);
}

TEST_CASE("focal lengths as of pixels that are not square are warned of", "[scene][intrinsics]") {
  Camera camera = good;
  camera.fy = 1.3 * camera.fx;
  const auto lines = lines_with(frame_of("b", camera), 3);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].starts_with("images.txt: the focal lengths of b, 500 and 650 pixels, differ by more than a fifth"));
  camera.fy = 1.1 * camera.fx;
  CHECK(lines_with(frame_of("b", camera), 3).empty());
}
