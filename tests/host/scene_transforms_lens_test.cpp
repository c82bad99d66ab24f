// Tests engine/scene/formats/transforms_lens.h and transforms_intrinsics.h: lenses and intrinsics of transforms*.json.
#include <catch2/catch.hpp>

#include <cmath>

#include "scene/formats/transforms_json.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

const std::string pose = "\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]";

std::string file_with(const std::string& shared, const std::string& own = "") {
  return "{" + shared + (shared.empty() ? "" : ", ") + "\"frames\": [{\"file_path\": \"a\", " + own +
         (own.empty() ? "" : ", ") + pose + "}]}";
}

Transforms read(const std::string& shared, const std::string& own = "") {
  Findings ignored;
  return parse_transforms(file_with(shared, own), "t", ignored);
}

std::vector<std::string> lines_of(const std::string& shared) {
  Findings findings;
  parse_transforms(file_with(shared), "t", findings);
  return findings.lines();
}

Lens lens_of(const std::string& shared, const std::string& own = "") { return read(shared, own).frames.at(0).lens; }

Camera camera_with(const std::string& shared, const std::string& own = "") {
  return camera_of(read(shared, own).frames.at(0), {640, 480});
}

std::string problem(const std::string& shared, const std::string& own = "") {
  return test::message_of([&] { read(shared, own); });
}

const std::string f = "\"fl_x\": 500";

}  // namespace

TEST_CASE("the matrix K in all forms", "[scene][transforms][intrinsics]") {
  for (const char* k :
       {"\"K\": [[500, 0, 320], [0, 510, 240], [0, 0, 1]]", "\"K\": [500, 0, 320, 0, 510, 240, 0, 0, 1]",
        "\"intrinsics\": [[500, 0, 320, 0], [0, 510, 240, 0], [0, 0, 1, 0]]",
        "\"intrinsic_matrix\": [[500, 0, 320, 0], [0, 510, 240, 0], [0, 0, 1, 0], [0, 0, 0, 1]]",
        "\"K\": [500, 0, 0, 0, 510, 0, 320, 240, 1]", "\"intrinsics\": [500, 510, 320, 240]",
        "\"intrinsics\": {\"fx\": 500, \"fy\": 510, \"cx\": 320, \"cy\": 240}"}) {
    INFO(k);
    for (const Camera& camera : {camera_with(k), camera_with("", k)}) {
      CHECK(camera.fx == 500);
      CHECK(camera.fy == 510);
      CHECK(camera.cx == 320);
      CHECK(camera.cy == 240);
    }
  }
  CHECK(problem("", "\"K\": [[500, 9, 320], [0, 510, 240], [0, 0, 1]]") ==
        "t: frames[0].K has a skew of 9 pixels, which is not read; undistort the images");
  CHECK(problem("", "\"K\": [[-500, 0, 320], [0, 510, 240], [0, 0, 1]]")
            .find("has a focal length of -500, but it must ") != std::string::npos);
  CHECK(problem("", "\"K\": [1, 2, 3]") ==
        "t: frames[0].K is not a 3 x 3 matrix of intrinsics; write fl_x, fl_y, cx and cy instead");
}

TEST_CASE("intrinsics of the frame win; those of one place must agree", "[scene][transforms][intrinsics]") {
  const std::string k = "\"K\": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]";
  CHECK(camera_with("\"fl_x\": 900, \"fl_y\": 900", k).fy == 500);
  CHECK(camera_with(k, "\"fl_x\": 900, \"fl_y\": 900").fx == 900);
  CHECK(problem("", k + ", \"fl_x\": 900") == "t: frames[0].fl_x is 900 but K has 500; remove the wrong one");
  CHECK(problem(k + ", \"cx\": 100") == "t: cx is 100 but K has 320; remove the wrong one");
  CHECK(problem("", k + ", \"fl_x\": 500.4").empty());
  // A field of view of the frame against a focal length of the file.
  const Camera camera = camera_with("\"fl_x\": 900, \"w\": 640", "\"camera_angle_x\": 1.0");
  CHECK(camera.fx == Approx(320 / std::tan(0.5)));
  CHECK(camera_with("\"x_fov\": 90").fx == Approx(320));
  CHECK(camera_with("\"fx\": 500, \"fy\": 510").fy == 510);
  CHECK(camera_with("\"fl_x\": 500, \"w\": 100", "\"w\": 1280, \"h\": 960").width == 1280);
}

TEST_CASE("k4 to k6 are a denominator if k5, k6 or FULL_OPENCV is there", "[scene][transforms][lens]") {
  const std::string k = f + ", \"k1\": 0.1, \"k2\": 0.2, \"k3\": 0.3, \"k4\": 0.4";
  CHECK(lens_of(k).radial == std::array<double, 4>{0.1, 0.2, 0.3, 0.4});
  for (const std::string& more : {std::string(", \"k5\": 0.5, \"k6\": 0.6"), std::string(", \"k5\": 0, \"k6\": 0"),
                                  std::string(", \"camera_model\": \"FULL_OPENCV\"")}) {
    const Lens lens = lens_of(k + more);
    CHECK(lens.radial == std::array<double, 4>{0.1, 0.2, 0.3, 0});
    CHECK(lens.denominator[0] == 0.4);
  }
}

TEST_CASE("distortion coefficients as lists", "[scene][transforms][lens]") {
  const auto check = [](const Lens& lens) {
    CHECK(lens.radial[0] == 0.1);
    CHECK(lens.radial[1] == 0.2);
    CHECK(lens.p1 == 0.01);
    CHECK(lens.p2 == 0.02);
  };
  check(lens_of(f + ", \"distortion_params\": [0.1, 0.2, 0, 0, 0.01, 0.02]"));
  check(lens_of(f, "\"distortion_params\": [0.1, 0.2, 0, 0, 0.01, 0.02]"));
  check(lens_of(f + ", \"k1\": 9", "\"distortion_params\": [0.1, 0.2, 0, 0, 0.01, 0.02]"));
  check(lens_of(f + ", \"distortion_coefficients\": [[0.1, 0.2, 0.01, 0.02, 0]]"));
  check(lens_of(f + ", \"distortion\": {\"k1\": 0.1, \"k2\": 0.2, \"p1\": 0.01, \"p2\": 0.02}"));
  CHECK(lens_of(f + ", \"distortion_params\": [0.1, 0.2, 0.3, 0.4], \"camera_model\": \"OPENCV_FISHEYE\"").radial[3] ==
        0.4);
  // A frame's own coefficients replace the list of the file.
  CHECK(lens_of(f + ", \"distortion_params\": [0.1, 0.2, 0, 0, 0, 0]", "\"k1\": 0.5").radial ==
        std::array<double, 4>{0.5, 0, 0, 0});
  CHECK(problem(f + ", \"distortion_params\": [0.1, 0.2, 0.3, 0.4]") ==
        "t: distortion_params has 4 numbers in an unknown order; write k1, k2, k3, k4, p1 and p2 instead");
  CHECK(problem(f + ", \"distortion_params\": [0.1, 0, 0, 0, 0, 0], \"k1\": 0.3") ==
        "t: distortion_params has k1 = 0.1 but t: k1 is 0.3; remove the wrong one");
  CHECK(problem(f + ", \"distortion_params\": [0.1, 0, 0, 0, 0, 0], \"k1\": 0").empty());
}

TEST_CASE("is_fisheye, latlong and f-theta of instant-ngp", "[scene][transforms][lens]") {
  for (const char* yes : {"true", "1", "\"true\"", "\"True\""})
    CHECK(lens_of(f + ", \"k1\": 0.1, \"is_fisheye\": " + yes).model == Lens::Model::fisheye);
  for (const char* no : {"false", "0", "\"false\""})
    CHECK(lens_of(f + ", \"k1\": 0.1, \"is_fisheye\": " + no).model == Lens::Model::perspective);
  CHECK(problem(f + ", \"is_fisheye\": 2") == "t: is_fisheye is number, not true or false; correct it");
  CHECK(problem(f + ", \"is_fisheye\": true, \"camera_model\": \"OPENCV\"") ==
        "t: is_fisheye contradicts camera_model OPENCV; remove is_fisheye, or write camera_model OPENCV_FISHEYE");
  CHECK(lens_of(f + ", \"is_fisheye\": true", "\"camera_model\": \"OPENCV\"").model == Lens::Model::perspective);
  CHECK(lens_of(f + ", \"is_fisheye\": true, \"camera_model\": \"FISHEYE\"").model == Lens::Model::fisheye);
  CHECK(lens_of(f + ", \"latlong\": true").is_panorama());
  CHECK(lens_of("\"camera_model\": \"EQUIRECTANGULAR\"").is_panorama());
  CHECK(problem(f + ", \"equirectangular\": true").find("or write camera_model EQUIRECTANGULAR for panoramas ") !=
        std::string::npos);
  // The angle is a polynomial of the distance in pixels.
  const Transforms t = read(
      "\"w\": 640, \"h\": 480, \"ftheta_p0\": 0, \"ftheta_p1\": 0.002, \"ftheta_p2\": 1e-7, "
      "\"ftheta_p3\": 1e-10, \"ftheta_p4\": 0, \"camera_angle_x\": 1");
  const Camera camera = camera_of(t.frames[0], {640, 480});
  CHECK(camera.fx == Approx(500));
  for (const double pixels : {10.0, 150.0, 300.0}) {
    const double angle = 0.002 * pixels + 1e-7 * pixels * pixels + 1e-10 * std::pow(pixels, 3);
    CHECK(camera.fx * t.frames[0].lens.distort({0, std::tan(angle)}).y == Approx(pixels));
  }
}

TEST_CASE("a model per frame, unknown models, and coefficients beside PINHOLE", "[scene][transforms][lens]") {
  CHECK(lens_of(f + ", \"camera_model\": \"OPENCV\"", "\"camera_model\": \"opencv_fisheye\"").model ==
        Lens::Model::fisheye);
  const std::string pinhole = f + ", \"k1\": 0.1, \"camera_model\": \"PINHOLE\"";
  CHECK(lens_of(pinhole).radial[0] == 0.1);
  REQUIRE(lines_of(pinhole).size() == 1);
  CHECK(lines_of(pinhole)[0].starts_with("t: camera_model PINHOLE stands beside distortion coefficients, which "));
  CHECK(lines_of(f + ", \"k1\": 0, \"camera_model\": \"PINHOLE\"").empty());
  CHECK(lens_of(f + ", \"k1\": 0.9, \"camera_model\": \"FOV\"").radial[0] == 0.9);
  CHECK(problem(f + ", \"camera_model\": \"VR180_L\"").starts_with("t: camera_model is VR180_L, which is not read; "));
  // One frame of two.
  Findings findings;
  const Transforms two =
      parse_transforms("{" + f + ", \"frames\": [{\"file_path\": \"a\", " + pose +
                           "}, {\"file_path\": \"b\", \"camera_model\": \"ORTHOPHOTO\", " + pose + "}]}",
                       "t", findings);
  REQUIRE(two.frames.size() == 1);
  CHECK(two.frames[0].file_path == "a");
  REQUIRE(findings.lines().size() == 1);
  CHECK(findings.lines()[0].find("left out 1 photograph: ") != std::string::npos);
  CHECK(findings.lines()[0].find("camera_model is ORTHOPHOTO, which is not read; ") != std::string::npos);
}

TEST_CASE("keys that would change the picture but are not read are reported", "[scene][transforms][lens]") {
  const auto lines = lines_of(f + ", \"omega\": 0.5, \"rolling_shutter\": [0, 0, 0.1, 0]");
  REQUIRE(lines.size() == 2);
  CHECK(lines[0] == "t: omega not read with camera_model PINHOLE; undistort the photographs if this matters");
  CHECK(lines[1] == "t: rolling_shutter is not read; photographs are taken as of one instant");
  CHECK(lines_of(f + ", \"omega\": 0, \"rolling_shutter\": [0, 0, 0, 0]").empty());
}
