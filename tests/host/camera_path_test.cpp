// Tests engine/render/camera_path.h, engine/render/camera_path_file.h and viewer/file_cameras.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/read_file.h"
#include "render/camera_path_file.h"
#include "scene/text/json_numbers.h"
#include "temporary_folder.h"
#include "viewer/file_cameras.h"

using namespace trisoup;
using Catch::Contains;
using nlohmann::json;

namespace {

glm::dvec3 vector_from(const json& v) { return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}; }

render::PathContext context_of(const json& one) {
  return {{vector_from(one["normalisation"]["centre"]), one["normalisation"]["scale"].get<double>()},
          vector_from(one["up"]),
          glm::radians(one["fov"].get<double>()),
          one["aspect"].get<double>()};
}

render::CameraPath path_from(const std::string& text) {
  const render::PathContext context{{{10, 20, 30}, 0.5}, {0, 0, 1}, 0.7, 1.5};
  return render::read_camera_path(scene::parse_json(text, "p.json"), "p.json", context);
}

/// A camera one unit above the origin that looks along -z, as nerfstudio and NeRF-Synthetic write it.
const std::string kPose = "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]]";

viewer::FileCameras cameras_from(const std::string& text, const viewer::FileCameraOptions& options = {}) {
  const test::TemporaryFolder folder;
  viewer::Subject subject;
  subject.model.centre = {0, 0, 0};
  subject.model.scale = 0.5;
  return viewer::read_file_cameras(subject, folder.file("views.json", text), options);
}

}  // namespace

TEST_CASE("camera paths have the cameras of web pages", "[camera_path]") {
  const json cases = json::parse(read_file(TRISOUP_SOURCE_DIR "/tests/web/path_cases.json"));
  REQUIRE(cases.size() >= 4);
  for (const json& one : cases) {
    CAPTURE(one["name"].get<std::string>());
    const json dataparser = one.contains("dataparser") ? one["dataparser"] : json(nullptr);
    const render::CameraPath path = render::read_camera_path(one["document"], "case", context_of(one), dataparser);
    REQUIRE(one["cameras"].size() == one["times"].size());
    for (std::size_t i = 0; i < one["times"].size(); ++i) {
      CAPTURE(i);
      const json& expected = one["cameras"][i];
      const scene::Camera camera = render::camera_of(render::shot_at(path.keys, one["times"][i].get<double>()),
                                                     one["size"][0].get<int>(), one["size"][1].get<int>());
      CHECK(glm::length(camera.centre() - vector_from(expected["eye"])) < 1e-9);
      for (int axis = 0; axis < 9; ++axis)
        CHECK(std::abs(camera.world_to_camera[axis % 3][axis / 3] -
                       expected["axes"][static_cast<std::size_t>(axis)].get<double>()) < 1e-9);
      CHECK(camera.fx == Approx(expected["focal"].get<double>()).epsilon(1e-9));
      CHECK(camera.fy == camera.fx);
    }
  }
}

TEST_CASE("a camera path that is written is read again", "[camera_path]") {
  render::CameraPath path;
  for (int i = 0; i < 3; ++i) {
    scene::Camera camera =
        render::look_at({1 + i, 2, 0.5 * i}, {0, 0.1 * i, 0}, {0.1, 0.2, 1}, 0.4 + 0.2 * i, 640, 360);
    camera.fx = 1.1 * camera.fy;
    path.keys.push_back({1.25 * i, render::shot_of(camera)});
    const scene::Camera again = render::camera_of(path.keys.back().shot, 640, 400);
    CHECK(again.fy == Approx(camera.fx).epsilon(1e-12));  // its width is seen
    CHECK(glm::length(again.centre() - camera.centre()) < 1e-12);
    CHECK(glm::length(again.forward() - camera.forward()) < 1e-12);
  }
  path.loop = true;
  const render::PathContext context{{{10, 20, 30}, 0.5}, {0, 0, 1}, 0.7, 1.5};
  const json written = render::write_camera_path(path, context.normalisation);
  const render::CameraPath again = render::read_camera_path(written, "p.json", context);
  REQUIRE(again.keys.size() == 3);
  CHECK((again.loop && !again.fps && !again.size));
  for (std::size_t i = 0; i < 3; ++i) {
    const render::KeyShot &a = path.keys[i], &b = again.keys[i];
    CHECK(a.time == b.time);
    CHECK(glm::length(a.shot.eye - b.shot.eye) < 1e-12);
    CHECK(std::abs(glm::dot(a.shot.turn, b.shot.turn)) == Approx(1).epsilon(1e-12));
    CHECK(a.shot.height == Approx(b.shot.height).epsilon(1e-12));
    CHECK(a.shot.aspect == Approx(b.shot.aspect).epsilon(1e-12));
  }
}

TEST_CASE("pictures of a path follow its frame rate", "[camera_path]") {
  render::CameraPath path;
  path.keys = {{0, {}}, {0.5, {}}, {2, {}}};
  CHECK(render::picture_times(path, std::nullopt).size() == 61);
  CHECK(render::picture_times(path, 2.0) == std::vector<double>{0, 0.5, 1, 1.5, 2});
  CHECK(render::picture_times(path, 0.4) == std::vector<double>{0});
  path.loop = true;
  CHECK(render::picture_times(path, 2.0) == std::vector<double>{0, 0.5, 1, 1.5});
  path.fps = 24;
  CHECK(render::picture_times(path, std::nullopt) == std::vector<double>{0, 0.5, 2});
  path.keys[2].time = 1e9;
  CHECK_THROWS_WITH(render::picture_times(path, 2.0), Contains("--fps"));
  path.keys = {{0, {}}};
  CHECK(render::picture_times(path, 2.0) == std::vector<double>{0});
}

TEST_CASE("a path that is none names the key frame", "[camera_path]") {
  const auto refused = [](const std::string& text, const std::string& words) {
    CAPTURE(text);
    CHECK_THROWS_WITH(path_from(text), Contains(words) && !Contains("\n"));
  };
  const std::string pose = R"("position": [1, 2, 3], "target": [0, 0, 0])";
  refused("null", "p.json: is not a camera path");
  refused("[]", "is not a camera path");
  refused(R"({"keyframes": []})", "is not a camera path");
  refused(R"({"keyframes": [null]})", "keyframes[0].time is missing; give seconds");
  refused(R"({"keyframes": [{"time": -1, )" + pose + "}]}", "keyframes[0].time is -1");
  refused(R"({"keyframes": [{"time": 0}]})", "keyframes[0] has no pose");
  refused(R"({"keyframes": [{"time": 0, )" + pose + R"(}, {"time": 0, )" + pose + "}]}", "keyframes[1].time is 0, not");
  refused(R"({"keyframes": [{"time": 0, "position": [1, NaN, 3], "target": [0, 0, 0]}]})",
          "keyframes[0].position is [1,\"NaN\",3]; give 3 finite");
  refused(R"({"keyframes": [{"time": 0, "position": [1, 2, 3], "target": [1, 2, 3]}]})", "target is at its position");
  refused(R"({"keyframes": [{"time": 0, "position": [1e7, 2, 3], "target": [1, 2, 3]}]})", "too far from the scene");
  refused(R"({"keyframes": [{"time": 0, "fov": 0, )" + pose + "}]}", "fov is 0; give a number from 1 to 170 degrees");
  refused(R"({"keyframes": [{"time": 0, "matrix": [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1]}]})", "is not a rotation");
  refused(R"({"camera_path": [{}], "fps": 1})", "camera_path[0].camera_to_world is missing");
  refused(R"({"camera_path": [{}]})", "has no fps");
  refused(R"({"camera_path": [{"camera_type": "equirectangular"}], "fps": 1})", "only perspective");
  refused(R"({"camera_type": "equirectangular", "camera_path": [{}], "fps": 1})", "p.json: camera_type is");
  refused(R"({"camera_path": [{"camera_to_world": [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,1]}], "fps": 1})",
          "camera_path[0].camera_to_world is not a rotation");
  refused(R"({"render_height": 90, "camera_path": [{"camera_to_world": )" + kPose + R"(}], "fps": 1})",
          "render_width is missing");
  refused(R"({"loop": "yes", "keyframes": [{"time": 0, )" + pose + "}]}", "loop is \"yes\"; give true or false");
  refused("{\n\"keyframes\": [\n", "line 2 is not valid JSON");
}

TEST_CASE("nerfstudio's dataparser turns, shifts and scales, and nothing else", "[camera_path]") {
  const json document =
      json::parse(R"({"seconds": 2, "camera_path": [{"fov": 60, "camera_to_world": )" + kPose + "}]}");
  const auto read = [&](const std::string& dataparser) {
    return render::read_camera_path(document, "p.json", {}, json::parse(dataparser));
  };
  CHECK(read(R"({"transform": [[1,0,0,0.5], [0,1,0,0], [0,0,1,0]], "scale": 2})").keys.size() == 1);
  CHECK_THROWS_WITH(read(R"({"transform": [[2,0,0,0], [0,2,0,0], [0,0,2,0]], "scale": 2})"),
                    Contains("scale of its own"));
  CHECK_THROWS_WITH(read(R"({"transform": [[0,0,0,0], [0,0,0,0], [0,0,0,0]], "scale": 2})"),
                    Contains("transform is not a rotation"));
}

TEST_CASE("nerfstudio's path gives a picture for each of its cameras", "[camera_path]") {
  const std::string camera = R"({"fov": 60, "camera_to_world": )" + kPose + "}";
  const auto views =
      cameras_from(R"({"render_width": 64, "render_height": 48, "fps": 24, "seconds": 9, "camera_path": [)" + camera +
                   "," + camera + "," + camera + "]}");
  REQUIRE(views.cameras.size() == 3);
  CHECK(views.fps == 24);
  CHECK(views.cameras[1].width == 64);
  CHECK(views.cameras[1].height == 48);
  CHECK(glm::length(views.cameras[1].centre() - glm::dvec3(0, 0, 0.5)) < 1e-12);
  CHECK(glm::length(views.cameras[1].forward() - glm::dvec3(0, 0, -1)) < 1e-12);
}

TEST_CASE("the cameras of a transforms.json are those of its frames", "[camera_path]") {
  const std::string frame = R"({"file_path": "a.png", "transform_matrix": )" + kPose + "}";
  const std::string frames = R"("frames": [)" + frame + "," + frame + "]";
  const auto views = cameras_from(R"({"w": 60, "h": 40, "fl_x": 50, "cx": 20, )" + frames + "}");
  REQUIRE(views.cameras.size() == 2);
  CHECK(views.cameras[0].width == 60);
  CHECK(views.cameras[0].fy == 50);
  CHECK(views.cameras[0].cx == 20);
  CHECK(glm::length(views.cameras[0].centre() - glm::dvec3(0, 0, 0.5)) < 1e-12);
  CHECK(glm::length(views.cameras[0].forward() - glm::dvec3(0, 0, -1)) < 1e-12);
  CHECK_THROWS_WITH(cameras_from(R"({"camera_angle_x": 0.6, )" + frames + "}"),
                    Contains("a.png has no size; add w and h"));
  viewer::FileCameraOptions sized;
  sized.size = {80, 60};
  CHECK(cameras_from(R"({"camera_angle_x": 0.6, )" + frames + "}", sized).cameras[0].fx == Approx(40 / std::tan(0.3)));
  CHECK_THROWS_WITH(cameras_from(R"({"w": 60, "h": 40, "frames": [)" + frame + "]}"), Contains("no focal length"));
  CHECK_THROWS_WITH(cameras_from(R"({"w": 60, "h": 40, "fl_x": 50, "frames": []})"), Contains("views.json"));
  CHECK_THROWS_WITH(
      cameras_from(R"({"w": 60, "h": 40, "fl_x": 50, "frames": [{"file_path": "far.png", "transform_matrix":
          [[1,0,0,1e7], [0,1,0,0], [0,0,1,0], [0,0,0,1]]}]})"),
      Contains("far.png: the position 1e+07, 0, 0 is too far"));
  CHECK_THROWS_WITH(cameras_from(R"({"fl_x": 50})"), Contains("has no cameras; give a path"));
  CHECK_THROWS_WITH(
      cameras_from(R"({"w": 60, "h": 40, "fl_x": 50, "frames": [)" + frame + R"(, {"file_path": "b.png"}]})"),
      Contains("b.png; correct or remove them"));
  viewer::FileCameraOptions parsed;
  parsed.dataparser = "d.json";
  CHECK_THROWS_WITH(cameras_from(R"({"w": 60, "h": 40, "fl_x": 50, )" + frames + "}", parsed),
                    Contains("--dataparser"));
}

TEST_CASE("a transforms.json with a distorted lens is told from one without", "[camera_path]") {
  const auto file = [](const std::string& lens) {
    return R"({"w": 40, "h": 30, "fl_x": 50, "cx": 20, "cy": 15, )" + lens +
           R"("frames": [{"file_path": "a.png", "transform_matrix": )" + kPose + "}]}";
  };
  CHECK_FALSE(cameras_from(file("")).distorted);
  CHECK_FALSE(cameras_from(file(R"("k1": 0, )")).distorted);
  CHECK(cameras_from(file(R"("k1": 0.1, )")).distorted);
}
