// Tests engine/scene/lens/camera_models.h: every camera model of COLMAP, in its text, binary and in JSON.
#include <catch2/catch.hpp>

#include <array>
#include <sstream>

#include "base/read_file.h"
#include "packed.h"
#include "scene/formats/colmap_model.h"
#include "scene/formats/transforms_json.h"
#include "scene/lens/camera_models.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

struct Reference {
  const char* model;
  const char* parameters;
  std::array<double, 4> pixels;  // of the directions (0.3, -0.2, 1) and (-0.5, 0.4, 1)
};

// Computed in Python from the formulas of the papers; those of the division model by bisection.
const std::array<Reference, 17> references{{
    {"SIMPLE_PINHOLE", "60 33.5 23", {51.5, 11, 3.5, 47}},
    {"PINHOLE", "60 62 33.5 23", {51.5, 10.6, 3.5, 47.8}},
    {"SIMPLE_RADIAL", "60 33.5 23 -0.25", {50.915, 11.39, 6.575, 44.54}},
    {"RADIAL", "60 33.5 23 -0.2 0.05", {51.04721, 11.30186, 5.70785, 45.23372}},
    {"OPENCV", "60 62 33.5 23 -0.2 0.05 0.01 -0.02", {50.60321, 11.190922, 4.37585, 46.923444}},
    {"OPENCV_FISHEYE",
     "60 62 33.5 23 0.05 -0.03 0.02 -0.01",
     {50.872269949461, 11.032436257038, 6.452276668182, 45.359451287637}},
    {"FULL_OPENCV",
     "60 62 33.5 23 -0.25 0.1 0.02 -0.015 -0.03 0.1 0.03 0.02",
     {50.288008279465, 11.515527629702, 6.072766819510, 45.876539429205}},
    {"FOV", "60 62 33.5 23 0.9", {52.093085258485, 10.191430155266, 4.660290177469, 46.840826786625}},
    {"SIMPLE_RADIAL_FISHEYE", "60 33.5 23 0.1", {50.982581005184, 11.344945996544, 5.950536404876, 45.039570876099}},
    {"RADIAL_FISHEYE", "60 33.5 23 0.1 -0.05", {50.970194584035, 11.353203610644, 6.090914924410, 44.927268060472}},
    {"THIN_PRISM_FISHEYE",
     "60 62 33.5 23 0.05 -0.03 0.01 -0.02 0.02 -0.01 0.03 -0.04",
     {50.678830099774, 10.992458688102, 5.982335903579, 45.305495125775}},
    {"RAD_TAN_THIN_PRISM_FISHEYE",
     "60 62 33.5 23 0.05 -0.03 0.02 -0.01 0.005 -0.002 0.01 -0.02 0.03 -0.01 -0.04 0.02",
     {51.388822470713, 10.438455817343, 7.819151984965, 43.733560581022}},
    {"SIMPLE_DIVISION", "60 33.5 23 -0.25", {50.950191737267, 11.366538841822, 6.070603604323, 44.943517116541}},
    {"DIVISION", "60 62 33.5 23 0.2", {51.994042782175, 10.259659416724, 0.528547794531, 50.256400489855}},
    {"SIMPLE_FISHEYE", "60 33.5 23", {50.775707042065, 11.482861971956, 6.816082343120, 44.347134125504}},
    {"FISHEYE", "60 62 33.5 23", {50.775707042065, 11.098957371022, 6.816082343120, 45.058705263021}},
    {"EUCM", "60 62 33.5 23 0.6 1.1", {50.783311728253, 11.093718587203, 6.779768609062, 45.088724616509}},
}};

std::vector<double> numbers_of(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream stream(text);
  for (double number; stream >> number;) numbers.push_back(number);
  return numbers;
}

std::array<double, 4> pixels_of(const Camera& camera, const Lens& lens) {
  std::array<double, 4> pixels{};
  std::size_t i = 0;
  for (const glm::dvec2 direction : {glm::dvec2(0.3, -0.2), glm::dvec2(-0.5, 0.4)}) {
    const glm::dvec2 point = lens.distort(direction);
    pixels[i++] = camera.fx * point.x + camera.cx, pixels[i++] = camera.fy * point.y + camera.cy;
  }
  return pixels;
}

void check_pixels(const Reference& reference, const Camera& camera, const Lens& lens) {
  const auto pixels = pixels_of(camera, lens);
  for (std::size_t i = 0; i < 4; ++i) CHECK(pixels[i] == Approx(reference.pixels[i]).margin(1e-9));
}

std::string json_of(const CameraModel& model, const std::vector<double>& p) {
  std::string text = fmt::format("{{\"camera_model\": \"{}\", \"fl_x\": {}, \"fl_y\": {}, \"cx\": {}, \"cy\": {}, ",
                                 model.name, p[0], p[model.focals - 1], p[model.focals], p[model.focals + 1]);
  for (std::size_t i = 0; i < model.coefficients.size(); ++i)
    text += fmt::format("\"{}\": {}, ", model.coefficients[i].name, p[model.focals + 2 + i]);
  return text + "\"frames\": [{\"file_path\": \"a\", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]}]}";
}

}  // namespace

TEST_CASE("every camera model projects as its formula, from text, binary and JSON", "[scene][camera_models]") {
  for (const Reference& reference : references) {
    INFO(reference.model);
    const std::vector<double> p = numbers_of(reference.parameters);
    const CameraModel* model = find_camera_model(reference.model);
    REQUIRE(model != nullptr);
    REQUIRE(model->parameters() == p.size());

    const auto text =
        parse_colmap_cameras_text(fmt::format("1 {} 64 48 {}", reference.model, reference.parameters), "file").at(1);
    check_pixels(reference, text.pinhole, text.lens);

    std::string bytes =
        test::pack(std::uint64_t(1), std::uint32_t(1), std::int32_t(model->id), std::uint64_t(64), std::uint64_t(48));
    for (const double number : p) bytes += test::pack(number);
    const auto binary = parse_colmap_cameras_binary(bytes_of(bytes), "file").at(1);
    CHECK(binary.model == reference.model);
    check_pixels(reference, binary.pinhole, binary.lens);

    Findings findings;
    const Transforms transforms = parse_transforms(json_of(*model, p), "file", findings);
    const TransformsFrame& frame = transforms.frames.at(0);
    check_pixels(reference, camera_of(frame, {64, 48}), frame.lens);
    CHECK(findings.lines().empty());
  }
}

TEST_CASE("a panorama of a COLMAP model has its size as parameters", "[scene][camera_models]") {
  const auto camera = parse_colmap_cameras_text("1 EQUIRECTANGULAR 64 32 64 32", "file").at(1);
  CHECK(camera.lens.is_panorama());
  CHECK(camera.pinhole.fx == Approx(64 / (2 * 3.14159265358979)));
  CHECK(test::message_of([] { parse_colmap_cameras_text("1 EQUIRECTANGULAR 64 32 64 31", "file"); }) ==
        "file: line 1: panorama of 64 x 32 pixels has parameters 64 and 31; they must equal its size");
}

TEST_CASE("another number of parameters than the model has is refused", "[scene][camera_models]") {
  const auto camera = [](const std::string& line) {
    return test::message_of([&] { parse_colmap_cameras_text("1 " + line, "file"); });
  };
  CHECK(camera("SIMPLE_PINHOLE 64 48 60 60 32 24") ==
        "file: line 1: has 4 parameters, but SIMPLE_PINHOLE has 3 (f, cx, cy); correct the model or the numbers");
  CHECK(camera("SIMPLE_RADIAL 64 48 60 32 24").find("has 3 parameters, but SIMPLE_RADIAL has 4 (f, cx, cy, k)") !=
        std::string::npos);
}

TEST_CASE("a camera that cannot be used does not end the run", "[scene][camera_models]") {
  const auto cameras =
      parse_colmap_cameras_text("1 PINHOLE 64 48 60 60 32 24\n2 NEW 64 48 60\n3 PINHOLE 64 48 -1 60 32 24\n", "file");
  REQUIRE(cameras.size() == 3);
  CHECK(cameras.at(1).problem.empty());
  CHECK(cameras.at(2).problem.starts_with("line 2: unknown camera model NEW; known models: SIMPLE_PINHOLE, "));
  CHECK(cameras.at(3).problem.starts_with("line 3: focal length -1 x 60 is not positive; "));
  // The size of a binary record of an unknown model is unknown, so only the last one can be passed over.
  const auto record = [](std::uint32_t id, std::int32_t model) {
    return test::pack(id, model, std::uint64_t(64), std::uint64_t(48), 60.0, 60.0, 32.0, 24.0);
  };
  const std::string last = test::pack(std::uint64_t(2)) + record(1, 1) + record(2, 99);
  CHECK(
      parse_colmap_cameras_binary(bytes_of(last), "file").at(2).problem.starts_with("camera 2: unknown camera model "));
  const std::string first = test::pack(std::uint64_t(2)) + record(1, 99) + record(2, 1);
  CHECK(test::message_of([&] {
          parse_colmap_cameras_binary(bytes_of(first), "file");
        }).starts_with("file: camera 1: unknown camera model 99; "));
}
