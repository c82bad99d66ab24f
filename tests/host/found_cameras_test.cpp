// Tests the parts of engine/scene/reconstruct/ that run no program: which cameras can be true, which mapping is used.
#include <catch2/catch.hpp>

#include <cmath>

#include "packed.h"
#include "scene/reconstruct/camera_groups.h"
#include "scene/reconstruct/camera_plausibility.h"
#include "scene/reconstruct/colmap_program.h"
#include "scene/reconstruct/found_model.h"
#include "scene/reconstruct/lens_refinement.h"
#include "scene/reconstruct/loop_pairs.h"
#include "scene/reconstruct/mapping_choice.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using Catch::Matchers::Contains;
using test::pack;

namespace {

constexpr scene::Camera kStreet{640, 480, 640, 640, 320, 240, glm::dmat4(1.0)};

std::string doubt(double fx, double fy, double exif = 0, double k1 = 0, double k2 = 0, double cx = 320) {
  scene::Camera camera = kStreet;
  camera.fx = fx, camera.fy = fy, camera.cx = cx;
  Lens lens;
  lens.radial[0] = k1, lens.radial[1] = k2;
  return implausibility(camera, lens, exif);
}

std::string how(std::vector<Mapping> so_far, std::size_t photographs, bool exif) {
  const auto next = next_try(so_far, photographs, exif);
  return next ? next->how.empty() ? "COLMAP's" : next->how : "enough";
}

std::string joined_arguments(std::vector<Mapping> so_far, bool exif) {
  const auto next = next_try(so_far, 29, exif);
  std::string text;
  for (const std::string& argument : next.value().arguments) text += argument + " ";
  return text;
}

/// Writes a model of two photographs that look along z and see one point, 1 and 3 pixels from where it is observed.
void write_two_views(const test::SceneFolder& folder, double f = 640) {
  folder.write("cameras.bin", pack(std::uint64_t(1), std::uint32_t(4), std::int32_t(2), std::uint64_t(640),
                                   std::uint64_t(480), f, 320.0, 240.0, 0.1));
  std::string images = pack(std::uint64_t(2));
  for (std::uint32_t i = 0; i < 2; ++i) {
    images += pack(i + 1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, std::uint32_t(4)) + (i == 0 ? "b" : "a") + '\0';
    // r = 0.5 is distorted to 0.5 (1 + 0.1 * 0.25).
    images += pack(std::uint64_t(2), 320 + f * 0.5125, 240 + 1.0 + 2 * i, std::uint64_t(9));
    images += pack(1.0, 2.0, std::int64_t(-1));
  }
  folder.write("images.bin", images);
  folder.write("points3D.bin", pack(std::uint64_t(1), std::uint64_t(9), 2.0, 0.0, 4.0, std::uint8_t(1), std::uint8_t(2),
                                    std::uint8_t(3), 77.0, std::uint64_t(1), std::int32_t(1), std::int32_t(0)));
}

}  // namespace

TEST_CASE("cameras that cannot be true are told", "[reconstruct][cameras]") {
  CHECK(doubt(640, 640, 640).empty());
  CHECK(doubt(640, 660).empty());
  CHECK(doubt(700, 700, 600).empty());
  CHECK_THAT(doubt(957, 204, 640), Contains("957 and 204 pixels, but pixels are square"));
  CHECK_THAT(doubt(221, 221, 640), Contains("221 pixels, but EXIF says 640"));
  CHECK_THAT(doubt(800, 800, 640), Contains("EXIF"));
  CHECK(doubt(221, 221).empty());
  CHECK_THAT(doubt(180, 180), Contains("180 pixels for a photograph of 640 x 480"));
  CHECK_THAT(doubt(2700, 2700), Contains("2700 pixels"));
  CHECK_THAT(doubt(NAN, NAN), Contains("pixels"));
  CHECK(doubt(640, 640, 0, 0, 0, 350).empty());
  CHECK_THAT(doubt(640, 640, 0, 0, 0, 400), Contains("principal point (400, 240)"));
  // The corner is at 0.625. A lens that folds over beyond is common; one that folds over before is none.
  CHECK(doubt(640, 640, 0, -0.25).empty());
  CHECK_THAT(doubt(640, 640, 0, -0.6), Contains("folds over"));
  CHECK_THAT(doubt(640, 640, 0, 5), Contains("moves the corners"));
}

TEST_CASE("another mapping is made only where the ones so far are not good", "[reconstruct][cameras]") {
  const Mapping good{29, "", 0.7}, bent{24, "f", 0.8}, few{11, "", 0.6}, none{};
  CHECK(how({}, 29, true) == "COLMAP's");
  CHECK(how({good}, 29, true) == "enough");
  CHECK(how({{28, "", 0.7}}, 29, true) == "enough");
  CHECK(how({{27, "", 0.7}}, 29, true) != "enough");
  CHECK(how({{9, "", 0.7}}, 10, true) != "enough");
  CHECK(how({bent}, 29, true) == "focal length held at EXIF's, narrow angles accepted");
  CHECK(how({bent}, 29, false) == "without distortion, narrow angles accepted");
  CHECK(how({bent, good}, 29, true) == "enough");
  CHECK(how({bent, bent}, 29, true) == "focal length held at EXIF's");
  CHECK(how({bent, bent}, 29, false) == "focal length held at 1.2 longer sides, narrow angles accepted");
  CHECK(how({few}, 29, true) == "narrow angles accepted");
  CHECK(how({none}, 29, false) == "narrow angles accepted");
  CHECK(how({few, few}, 29, true) == "focal length held at EXIF's, narrow angles accepted");
  CHECK(how({few, bent}, 29, true) == "focal length held at EXIF's, narrow angles accepted");
  CHECK(how({few, few}, 29, false) == "narrow angles accepted, another start");
  CHECK(how({few, few, few}, 29, false) == "enough");
  CHECK_THAT(joined_arguments({bent}, true), Contains("refine_focal_length 0") && Contains("refine_extra_params 0"));
  CHECK_THAT(joined_arguments({bent}, false), !Contains("refine_focal_length"));
  CHECK_THAT(joined_arguments({few}, true), Contains("tri_min_angle 0.5") && !Contains("refine"));
}

TEST_CASE("of several mappings, true cameras and many photographs win", "[reconstruct][cameras]") {
  const auto best = [](std::vector<Mapping> mappings) { return best_mapping(mappings); };
  CHECK(best({{24, "f", 0.5}, {23, "", 0.8}}) == 1);
  CHECK(best({{24, "f", 0.5}, {10, "", 0.8}}) == 0);
  CHECK(best({{24, "", 0.9}, {25, "", 0.9}, {25, "", 0.8}, {25, "", 0.8}}) == 2);
  CHECK(best({{0, "", 0}, {3, "f", 9}}) == 1);
  CHECK(smallest_part(48) == 10);
  CHECK(smallest_part(12) == 4);
  CHECK(smallest_part(4) == 3);
}

TEST_CASE("the parts of a mapping are counted, and a gap between them is named", "[reconstruct][cameras]") {
  const std::vector<std::vector<std::string>> parts{{"a", "b"}, {"c", "d", "e"}, {"g"}};
  const Pieces pieces = pieces_of(parts);
  CHECK(pieces.sizes == std::vector<std::size_t>{3, 2, 1});
  CHECK((pieces.from == "b" && pieces.to == "c"));
  CHECK(pieces_of(std::span(parts).first(1)).from.empty());
}

TEST_CASE("pairs that close loops are spread over the sequence", "[reconstruct][cameras]") {
  using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;
  CHECK(loop_pairs(0, 10).empty());
  CHECK(loop_pairs(11, 10).empty());
  CHECK(loop_pairs(12, 10) == Pairs{{0, 11}});
  const Pairs pairs = loop_pairs(400, 10);
  CHECK(pairs.size() == 40 * 39 / 2 - 39);  // neighbours of the 40 are 10 apart
  CHECK(pairs.front() == std::pair<std::size_t, std::size_t>(0, 20));
  CHECK(pairs.back() == std::pair<std::size_t, std::size_t>(370, 390));
  CHECK(match_list({"a", "b c", "d"}, {{0, 1}, {0, 2}, {1, 2}}) == "a d\n");
}

TEST_CASE("photographs of one size and zoom share a camera", "[reconstruct][cameras]") {
  const std::vector<PhotographFacts> facts{{"z", 640, 480, 4.28}, {"y", 640, 480, 0}, {"x", 640, 480, 4.3},
                                           {"w", 640, 480, 9},    {"v", 320, 480, 9}, {"u", 640, 480, 4.28}};
  using Groups = std::vector<std::vector<std::string>>;
  CHECK(camera_groups(facts) == Groups{{"v"}, {"y"}, {"z", "x", "u"}, {"w"}});
  CHECK(camera_groups({}).empty());
}

TEST_CASE("focal lengths are taken from COLMAP's output only if EXIF has them", "[reconstruct][cameras]") {
  CHECK(colmap_exif_focal("  Focal Length:    640.00px (Prior)") == 640.0);
  CHECK(colmap_exif_focal("I1128 10:00 f.cc:3]   Focal Length:    640.00px (Prior)") == 640.0);
  for (const char* line : {"", "  Focal Length:    768.00px", "  Focal Length:    -1.00px (Prior)", "(Prior)"})
    CHECK_FALSE(colmap_exif_focal(line));
}

TEST_CASE("the error of a model is measured from its observations", "[reconstruct][cameras]") {
  const test::SceneFolder folder;
  write_two_views(folder);
  const FoundModel model = read_found_model(folder.path());
  CHECK(model.names == std::vector<std::string>{"a", "b"});
  CHECK((model.points == 1 && model.observations == 2));
  CHECK(model.error == Approx(2));
  CHECK(implausibility(model, {}).empty());
  CHECK_THAT(implausibility(model, {{"a", 300}}), Contains("EXIF says 300"));
  CHECK(describe(model, {{"a", 600}}) == "SIMPLE_RADIAL, focal length 640 pixels (EXIF 600), error 2.00 pixels");
  for (const char* file : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const std::string bytes = test::content_of(folder / file);
    for (std::size_t cut = 1; cut < bytes.size(); cut += 3) {
      folder.write(file, bytes.substr(0, bytes.size() - cut));
      CHECK_FALSE(test::message_of([&] { read_found_model(folder.path()); }).empty());
    }
    folder.write(file, bytes);
  }
}

TEST_CASE("cameras get a richer model with the same projection", "[reconstruct][cameras]") {
  const test::SceneFolder folder;
  write_two_views(folder);
  FoundModel model = read_found_model(folder.path());
  CHECK(encode_cameras(model, {.model = "OPENCV", .photographs = 3}) == test::content_of(folder / "cameras.bin"));
  folder.write("cameras.bin", encode_cameras(model, {.model = "OPENCV", .photographs = 2}));
  model = read_found_model(folder.path());
  CHECK(model.cameras.at(4).model == "OPENCV");
  CHECK(model.cameras.at(4).pinhole.fy == 640);
  CHECK(model.error == Approx(2));
  // Photographs that led the mapper astray tell no finer terms.
  for (const LensStep& step : lens_steps(true)) CHECK(step.model == "SIMPLE_RADIAL");
  CHECK(lens_steps(false).back().principal_point);
  // A richer model is not reduced.
  CHECK(encode_cameras(model, {.model = "RADIAL"}) == test::content_of(folder / "cameras.bin"));
}
