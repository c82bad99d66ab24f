// Tests engine/scene/formats/transforms_json.h and pose.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "scene/formats/pose.h"
#include "scene/formats/transforms_json.h"
#include "scene_temporary_folder.h"

using namespace trisoup;

namespace {

scene::Transforms parse_transforms(std::string_view text, const std::string& name) {
  scene::Findings findings;
  return scene::parse_transforms(text, name, findings);
}

const std::string identity = "[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]";

std::string one_frame(const std::string& shared, const std::string& own = "", const std::string& matrix = identity) {
  return "{" + shared + "\"frames\": [{\"file_path\": \"./images/a\"" + own + ", \"transform_matrix\": " + matrix +
         "}]}";
}

std::string json_message(const std::string& text) {
  return test::message_of([&] { parse_transforms(text, "t.json"); });
}

}  // namespace

TEST_CASE("OpenGL poses become OpenCV world-to-camera matrices", "[scene][transforms]") {
  const auto frame = parse_transforms(one_frame("\"camera_angle_x\": 1.0,"), "t.json").frames.at(0);
  const scene::Camera camera = scene::camera_of(frame, {200, 100});
  CHECK(glm::distance(camera.centre(), glm::dvec3(1, 2, 3)) < 1e-12);
  CHECK(glm::distance(camera.forward(), glm::dvec3(0, 0, -1)) < 1e-12);
  // A point above and right of the axis (world y is up here) is in the upper right quadrant.
  const glm::dvec4 clip = scene::clip_from_world(camera, 0.1, 10) * glm::dvec4(1.1, 2.1, 2, 1);
  CHECK(clip.x / clip.w > 0);
  CHECK(clip.y / clip.w < 0);
}

TEST_CASE("an inexact rotation is replaced by the nearest rotation", "[scene][transforms]") {
  std::array<double, 16> pose{1.003, 0.002, 0, 1, -0.001, 0.998, 0.004, 2, 0, -0.003, 1.001, 3, 0, 0, 0, 1};
  const glm::dmat3 rotation(scene::from_opengl_pose(pose, "t"));
  const glm::dmat3 product = glm::transpose(rotation) * rotation;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) CHECK(product[i][j] == Approx(i == j ? 1.0 : 0.0).margin(1e-14));
  CHECK(glm::determinant(rotation) == Approx(1.0));
}

TEST_CASE("intrinsics: pixels, angles, per frame and shared", "[scene][transforms]") {
  const auto camera = [](const std::string& text) {
    return scene::camera_of(parse_transforms(text, "t").frames.at(0), {200, 100});
  };
  auto c = camera(one_frame("\"camera_angle_x\": 1.0,"));
  CHECK(c.fx == Approx(100 / std::tan(0.5)));
  CHECK(c.fy == c.fx);
  CHECK(c.cx == 100);
  CHECK(c.cy == 50);
  CHECK(c.width == 200);
  c = camera(one_frame("\"camera_angle_x\": 1.0, \"camera_angle_y\": 0.5,"));
  CHECK(c.fy == Approx(50 / std::tan(0.25)));
  c = camera(one_frame("\"fl_x\": 300, \"camera_angle_x\": 1.0, \"w\": 640.0, \"h\": 480, \"cx\": 310.5,"));
  CHECK(c.fx == 300);
  CHECK(c.fy == 300);
  CHECK(c.width == 640);
  CHECK(c.height == 480);
  CHECK(c.cx == 310.5);
  CHECK(c.cy == 240);
  c = camera(one_frame("\"fl_x\": 300, \"fl_y\": 310,", ", \"fl_x\": 333, \"cy\": 7"));
  CHECK(c.fx == 333);
  CHECK(c.fy == 310);
  CHECK(c.cy == 7);
}

TEST_CASE("camera models and their coefficients", "[scene][transforms]") {
  const std::string coefficients = "\"k1\": 0.1, \"k2\": 0.2, \"k3\": 0.3, \"p1\": 0.01, \"p2\": 0.02, \"fl_x\": 9,";
  const auto lens = [](const std::string& text) { return parse_transforms(text, "t").frames.at(0).lens; };
  CHECK(lens(one_frame(coefficients)).model == scene::Lens::Model::perspective);
  CHECK(lens(one_frame(coefficients)).radial == std::array<double, 4>{0.1, 0.2, 0.3, 0});
  CHECK(lens(one_frame(coefficients)).p2 == 0.02);
  CHECK(lens(one_frame(coefficients + "\"camera_model\": \"OPENCV_FISHEYE\",")).model == scene::Lens::Model::fisheye);
  CHECK(lens(one_frame(coefficients + "\"is_fisheye\": true,")).model == scene::Lens::Model::fisheye);
  CHECK(lens(one_frame("\"fl_x\": 9,")).is_pinhole());
}

TEST_CASE("masks, points and splits", "[scene][transforms]") {
  const auto t =
      parse_transforms(one_frame("\"fl_x\": 9, \"ply_file_path\": \"p.ply\", \"test_filenames\": [\"images/a\"],",
                                 ", \"mask_path\": \"m.png\""),
                       "t");
  CHECK(t.ply_file_path == "p.ply");
  CHECK(t.test_files == std::vector<std::string>{"images/a"});
  CHECK(t.frames[0].mask_path == "m.png");
  CHECK(parse_transforms("{\"frames\": []}", "t").frames.empty());
}

TEST_CASE("errors of transforms files name the problem, the place and the fix", "[scene][transforms]") {
  CHECK(json_message("{\n\"frames\": [\n oops ]}") ==
        "t.json: line 3 is not valid JSON; correct or export the file again");
  CHECK(json_message("") == "t.json: line 1 is not valid JSON; correct or export the file again");
  CHECK(json_message("{\"frames\": [NaN]}") == "t.json: frames[0] is string, not an object; correct it");
  CHECK(json_message("[]") == "t.json: is array, not an object with frames; give a transforms file");
  CHECK(json_message("{}") == "t.json: frames is missing; give a transforms file");
  CHECK(json_message("{\"frames\": 3}") == "t.json: frames is number, not a list; correct it");
  CHECK(json_message("{\"frames\": [3]}") == "t.json: frames[0] is number, not an object; correct it");
  CHECK(json_message("{\"frames\": [{}]}") ==
        "t.json: frames[0].file_path is missing; every frame needs the path of its image");
  CHECK(json_message("{\"frames\": [{\"file_path\": 7}]}") ==
        "t.json: frames[0].file_path is number, not a string; correct it");
  CHECK(json_message("{\"frames\": [{\"file_path\": \"\"}]}").starts_with("t.json: frames[0].file_path is empty; "));
  CHECK(json_message("{\"frames\": [{\"file_path\": \"a\\u0000b\"}]}")
            .starts_with("t.json: frames[0].file_path contains a zero "));
  CHECK(json_message("{\"frames\": [{\"file_path\": \"a\"}]}") ==
        "t.json: frames[0].transform_matrix is missing; every frame needs its 4 x 4 camera-to-world matrix");
  CHECK(json_message(one_frame("")) ==
        "t.json: frames[0] has no focal length; add fl_x or camera_angle_x to it or to the file");
  CHECK(json_message(one_frame("\"fl_x\": -4,")) == "t.json: fl_x is -4, but must lie between 0 and 1e+09; correct it");
  CHECK(json_message(one_frame("\"fl_x\": 0,", "")).starts_with("t.json: fl_x is 0, "));
  CHECK(json_message(one_frame("", ", \"fl_x\": \"7\"")) ==
        "t.json: frames[0].fl_x is string, not a number; correct it");
  CHECK(json_message(one_frame("\"camera_angle_x\": 3.2,")).starts_with("t.json: camera_angle_x is 3.2, "));
  CHECK(json_message(one_frame("\"fl_x\": 9, \"w\": 1e12,")).starts_with("t.json: w is "));
  CHECK(json_message(one_frame("\"fl_x\": 9, \"test_filenames\": 3,")).starts_with("t.json: test_filenames is number"));
  CHECK(json_message(one_frame("\"fl_x\": 9, \"is_fisheye\": 2,")).starts_with("t.json: is_fisheye is number"));
  const auto matrix = [](const std::string& m) { return json_message(one_frame("\"fl_x\": 9,", "", m)); };
  CHECK(matrix("[[1,0,0],[0,1,0],[0,0,1]]")
            .starts_with("t.json: frames[0].transform_matrix: row 0 does not have 4 numbers; "));
  CHECK(matrix("[1,2]").starts_with("t.json: frames[0].transform_matrix is not a list of 4 rows; "));
  CHECK(matrix("[[1,0,0,null],[0,1,0,0],[0,0,1,0],[0,0,0,1]]") ==
        "t.json: frames[0].transform_matrix[0][3] is null, not a number; correct it");
  CHECK(matrix("[[1,0.1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")
            .starts_with("t.json: frames[0]: pose is not a rotation and a tr"));
  CHECK(matrix("[[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]").find("mirroring") != std::string::npos);
  CHECK(matrix("[[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]").find("off by 3") != std::string::npos);
  CHECK(matrix("[[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]]").find("last row") != std::string::npos);
  CHECK(matrix("[[1,0,0,1e20],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("1e18") != std::string::npos);
  CHECK(matrix("[[1e300,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]").find("not a rotation") != std::string::npos);
  std::array<double, 16> pose{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, std::numeric_limits<double>::quiet_NaN(), 0, 0, 0, 1};
  CHECK_THROWS_AS(scene::from_opengl_pose(pose, "t"), Error);
}

TEST_CASE("bad frames are left out by name", "[scene][transforms]") {
  const auto frames = [](const std::string& bad) {
    const std::string good = "{\"file_path\": \"a.png\", \"transform_matrix\": " + identity + "}";
    scene::Findings findings;
    const auto read = scene::parse_transforms("{\"fl_x\": 9, \"frames\": [" + good + "," + bad + "," + good + "]}",
                                              "t.json", findings);
    CHECK(read.frames.size() == 2);
    CHECK(findings.left_out("photographs") == 1);
    return findings.lines().at(0);
  };
  const auto matrix = [&](const std::string& first_row, const std::string& more = "") {
    return frames("{\"file_path\": \"b.png\", \"transform_matrix\": [" + first_row + ",[0,1,0,0],[0,0,1,0],[0,0,0,1]]" +
                  more + "}");
  };
  const std::string start = "t.json: left out 1 photograph: ";
  for (const char* value : {"NaN", "Infinity", "-Infinity", "1e999", "-1e999", "nan", "-nan(ind)", "1.#QNAN"})
    CHECK(matrix(fmt::format("[1,0,0,{}]", value)) ==
          start + "pose is not finite; remove the frame or estimate its pose again: b.png");
  CHECK(matrix("[-1,0,0,0]").find("it mirrors; ") != std::string::npos);
  CHECK(matrix("[1,0,0,\"x\"]") == start + "transform_matrix[0][3] is string, not a number; correct it: b.png");
  CHECK(matrix("[1,0,0,0]", ", \"fl_x\": NaN") == start + "fl_x is not finite; correct it: b.png");
  CHECK(frames("null") == start + "is null, not an object; correct it: frames[1]");
  CHECK(frames("{\"transform_matrix\": " + identity + "}")
            .starts_with(start + "file_path is missing; every frame needs the path of its image: frames[1]"));
  CHECK(frames("{\"file_path\": NaN}") == start + "file_path is a number, not a string; correct it: frames[1]");
  CHECK(frames("{\"file_path\": \"b.png\"}").ends_with(": b.png"));
  CHECK(json_message("{\"frames\": [null, null]}") ==
        "t.json: frames[0] is null, not an object; correct it (none of its 2 photographs can be used)");
}

TEST_CASE("JSON as programs write it", "[scene][transforms]") {
  const auto path = [](const std::string& text) { return parse_transforms(text, "t").frames.at(0).file_path; };
  const std::string text = one_frame("\"fl_x\": +9, \"sharpness\": NaN, \"note\": \"NaN \\\" +1\",");
  CHECK(path("\xef\xbb\xbf" + text) == "./images/a");
  CHECK(parse_transforms(text, "t").frames.at(0).intrinsics.fx == 9);
  CHECK(path("{\"fl_x\": 9, \"frames\": [{\"file_path\": \"NaN.png\", \"x\": -Infinity, \"transform_matrix\": " +
             identity + "}]}") == "NaN.png");
  using namespace std::string_literals;
  CHECK(json_message("\xff\xfe{\0}\0"s) == "t.json: is text in UTF-16; save it as UTF-8");
  CHECK(json_message("{\n\"a\": NaN,\n oops}") == "t.json: line 3 is not valid JSON; correct or export the file again");
}
