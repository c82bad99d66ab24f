// Tests engine/scene/formats/colmap_model.h: text and binary models are equal, and damage is detected.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/read_file.h"
#include "packed.h"
#include "scene/formats/colmap_model.h"
#include "scene/formats/pose.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

using test::pack;

namespace {

std::string cameras_binary() {
  return pack(std::uint64_t(2), std::uint32_t(1), std::int32_t(1), std::uint64_t(64), std::uint64_t(48), 50.0, 51.0,
              31.0, 25.0) +
         pack(std::uint32_t(7), std::int32_t(4), std::uint64_t(80), std::uint64_t(60), 70.0, 71.0, 40.0, 30.0, 0.1, 0.2,
              0.3, 0.4);
}

std::string images_binary(std::uint64_t observations = 2) {
  std::string bytes = pack(std::uint64_t(1), std::uint32_t(3), std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0, 1.0, 2.0, 3.0,
                           std::uint32_t(7));
  bytes += std::string("a/b c.jpg") + '\0' + pack(observations);
  for (int i = 0; i < 2; ++i) bytes += pack(1.0, 2.0, std::int64_t(-1));
  return bytes;
}

std::string points_binary() {
  return pack(std::uint64_t(1), std::uint64_t(5), 1.0, 2.0, 3.0, std::uint8_t(10), std::uint8_t(20), std::uint8_t(30),
              0.5, std::uint64_t(1), std::int32_t(1), std::int32_t(2));
}

const std::string cameras_text =
    "# Camera list\n\n1 PINHOLE 64 48 50 51 31 25\r\n7 OPENCV 80 60 70 71 40 30 0.1 0.2 0.3 0.4\n";
const std::string images_text =
    "# Image list\n3 0.70710678118654752 0 0.70710678118654752 0 1 2 3 7 a/b c.jpg\n1 2 -1 1 2 -1\n"
    "4 1 0 0 0 0 0 0 1 second.jpg\n\n5 1 0 0 0 0 0 0 1 third.jpg";
const std::string points_text = "# points\n5 1 2 3 10 20 30 0.5 1 2\n";

// Calls a parser, whose kind of bytes and whose findings depend on the file.
template <typename Parse>
auto parsed(Parse parse, const std::string& content, Findings& findings) {
  if constexpr (std::is_invocable_v<Parse, std::string_view, const std::string&>)
    return parse(content, "file");
  else if constexpr (std::is_invocable_v<Parse, std::span<const std::byte>, const std::string&>)
    return parse(bytes_of(content), "file");
  else if constexpr (std::is_invocable_v<Parse, std::string_view, const std::string&, Findings&>)
    return parse(content, "file", findings);
  else
    return parse(bytes_of(content), "file", findings);
}

template <typename Parse>
auto parsed(Parse parse, const std::string& content) {
  Findings findings;
  auto result = parsed(parse, content, findings);
  CHECK(findings.lines().empty());
  return result;
}

template <typename Parse>
std::string message(Parse parse, const std::string& content) {
  Findings findings;
  return test::message_of([&] { parsed(parse, content, findings); });
}

using Names = std::vector<std::string>;
Names names_of(const std::vector<ColmapImage>& images) {
  Names names;
  for (const ColmapImage& image : images) names.push_back(image.name);
  return names;
}

void check_cameras(const ColmapCameras& cameras) {
  REQUIRE(cameras.size() == 2);
  const Camera& pinhole = cameras.at(1).pinhole;
  CHECK(pinhole.width == 64);
  CHECK(pinhole.height == 48);
  CHECK(pinhole.fx == 50);
  CHECK(pinhole.fy == 51);
  CHECK(pinhole.cx == 31);
  CHECK(pinhole.cy == 25);
  CHECK(cameras.at(1).lens.is_pinhole());
  CHECK(cameras.at(7).lens.radial == std::array<double, 4>{0.1, 0.2, 0, 0});
  CHECK(cameras.at(7).lens.p1 == 0.3);
  CHECK(cameras.at(7).lens.p2 == 0.4);
}

void check_image(const ColmapImage& image) {
  CHECK(image.name == "a/b c.jpg");
  CHECK(image.camera_id == 7);
  // A quarter turn about y maps x to -z.
  const glm::dvec4 turned = image.world_to_camera * glm::dvec4(1, 0, 0, 1);
  CHECK(glm::distance(turned, glm::dvec4(1, 2, 2, 1)) < 1e-12);
}

}  // namespace

TEST_CASE("COLMAP cameras, images and points in both encodings", "[scene][colmap]") {
  check_cameras(parse_colmap_cameras_binary(bytes_of(cameras_binary()), "file"));
  check_cameras(parse_colmap_cameras_text(cameras_text, "file"));
  const auto binary = parsed(parse_colmap_images_binary, images_binary());
  REQUIRE(binary.size() == 1);
  check_image(binary[0]);
  const auto text = parsed(parse_colmap_images_text, images_text);
  REQUIRE(text.size() == 3);
  check_image(text[0]);
  CHECK(text[1].name == "second.jpg");
  CHECK(text[2].name == "third.jpg");
  for (const PointCloud& cloud :
       {parsed(parse_colmap_points_binary, points_binary()), parsed(parse_colmap_points_text, points_text)}) {
    REQUIRE(cloud.positions.size() == 1);
    CHECK(cloud.positions[0] == glm::dvec3(1, 2, 3));
    CHECK(cloud.colours.at(0) == glm::u8vec3(10, 20, 30));
  }
}

TEST_CASE("the parameters of every COLMAP camera model are assigned correctly", "[scene][colmap]") {
  const auto camera = [](const std::string& line) { return parse_colmap_cameras_text("1 " + line, "file").at(1); };
  auto c = camera("SIMPLE_PINHOLE 64 48 50 31 25");
  CHECK(c.pinhole.fy == 50);
  CHECK(c.pinhole.cy == 25);
  CHECK(c.lens.is_pinhole());
  c = camera("SIMPLE_RADIAL 64 48 50 31 25 0.1");
  CHECK(c.lens.radial[0] == 0.1);
  c = camera("RADIAL 64 48 50 31 25 0.1 0.2");
  CHECK(c.pinhole.cx == 31);
  CHECK(c.lens.radial[1] == 0.2);
  c = camera("OPENCV_FISHEYE 64 48 50 51 31 25 1 2 3 4");
  CHECK(c.lens.model == Lens::Model::fisheye);
  CHECK(c.lens.radial == std::array<double, 4>{1, 2, 3, 4});
  c = camera("FULL_OPENCV 64 48 50 51 31 25 1 2 3 4 5 6 7 8");
  CHECK(c.lens.radial == std::array<double, 4>{1, 2, 5, 0});
  CHECK(c.lens.denominator == std::array<double, 3>{6, 7, 8});
  CHECK(c.lens.p2 == 4);
  c = camera("RADIAL_FISHEYE 64 48 50 31 25 1 2");
  CHECK(c.lens.model == Lens::Model::fisheye);
  CHECK(c.lens.radial[1] == 2);
  CHECK(camera("SIMPLE_RADIAL_FISHEYE 64 48 50 31 25 1").lens.model == Lens::Model::fisheye);
}

TEST_CASE("truncated COLMAP files are Errors", "[scene][colmap]") {
  const auto check = [](auto parse, const std::string& whole) {
    for (std::size_t size = 0; size < whole.size(); ++size) {
      INFO(size << " of " << whole.size());
      CHECK(message(parse, whole.substr(0, size)).starts_with("file: "));
    }
  };
  check(parse_colmap_cameras_binary, cameras_binary());
  check(parse_colmap_images_binary, images_binary());
  check(parse_colmap_points_binary, points_binary());
}

TEST_CASE("invalid counts are refused before memory is allocated", "[scene][colmap]") {
  const std::uint64_t huge = ~std::uint64_t(0);
  CHECK(
      message(parse_colmap_cameras_binary, pack(huge) + std::string(100, '\0')) ==
      "file: claims 18446744073709551615 camera records in 100 bytes; the file is cut off or damaged, export it again");
  CHECK(message(parse_colmap_images_binary, pack(huge / 64) + std::string(100, '\0')).find("claims") !=
        std::string::npos);
  CHECK(message(parse_colmap_points_binary, pack(huge / 24) + std::string(100, '\0')).find("claims") !=
        std::string::npos);
  CHECK(message(parse_colmap_images_binary, images_binary(huge / 24 + 2)).find("ends in the middle") !=
        std::string::npos);
}

TEST_CASE("errors of COLMAP files name the problem, the place and the fix", "[scene][colmap]") {
  const auto camera = [](const std::string& line) { return message(parse_colmap_cameras_text, line); };
  CHECK(camera("1 FOO 64 48 50 51 31 25 1")
            .starts_with("file: line 1: unknown camera model FOO; known models: SIMPLE_PINHOLE, "));
  CHECK(camera("# x\n1 PINHOLE 64 48 50 51 31") ==
        "file: line 2: has 3 parameters, but PINHOLE has 4 (fx, fy, cx, cy); correct the model or the numbers");
  CHECK(camera("1 PINHOLE 64 48 50 51 31 x").find("its parameters is 'x', not a usable number") != std::string::npos);
  CHECK(camera("-1 PINHOLE 64 48 50 51 31 1").find("its camera id is '-1'") != std::string::npos);
  CHECK(camera("1 PINHOLE 0 48 50 51 31 25").find("0 x 48 pixels") != std::string::npos);
  CHECK(camera("1 PINHOLE 64 4800000 50 51 31 25").find("pixels") != std::string::npos);
  CHECK(camera("1 PINHOLE 64 48 0 51 31 25").find("focal length 0 x 51 is not positive") != std::string::npos);
  CHECK(camera("1 PINHOLE 64 48 50 51 nan 25").find("not finite") != std::string::npos);
  CHECK(camera("1 PINHOLE 64 48 50 51 31 25\n1 PINHOLE 64 48 50 51 31 25").find("twice") != std::string::npos);
  std::string unknown = cameras_binary();
  unknown[12] = 18;
  CHECK(message(parse_colmap_cameras_binary, unknown)
            .starts_with("file: camera 1: unknown camera model 18; known models: "));
  const auto image = [](const std::string& line) { return message(parse_colmap_images_text, line); };
  CHECK(image("3 0 0 0 0 1 2 3 7 a.jpg\n\n") ==
        "file: line 1: quaternion is zero; remove the image or estimate its pose again");
  CHECK(image("3 nan 0 0 0 1 2 3 7 a.jpg\n\n").find("not finite") != std::string::npos);
  CHECK(image("3 1 0 0 0 1 inf 3 7 a.jpg\n\n").find("not finite") != std::string::npos);
  CHECK(image("3 1 0 0 0 1 2 3 7\n\n").find("ends before its image name") != std::string::npos);
  CHECK(message(parse_colmap_points_text, "5 1 2 nan 1 2 3 0 1\n").find("not finite") != std::string::npos);
  CHECK(message(parse_colmap_points_text, "5 1 2 3 1 2 300 0 1\n").find("colour is '300'") != std::string::npos);
}

TEST_CASE("COLMAP quaternions of any length are accepted", "[scene][colmap]") {
  for (const double length : {1e-200, 0.5, 1.0, 1e200}) {
    const glm::dmat3 r(from_colmap_pose({0.1 * length, -0.7 * length, 0.3 * length, 0.5 * length}, {}, "x"));
    CHECK(glm::determinant(r) == Approx(1.0));
    CHECK(glm::length(r[0]) == Approx(1.0));
    CHECK(std::abs(glm::dot(r[0], r[1])) < 1e-14);
  }
}

TEST_CASE("images.txt: what is a list of observations and what is the next image", "[scene][colmap]") {
  const std::string a = "3 1 0 0 0 1 2 3 7 a.jpg\n", b = "4 1 0 0 0 1 2 3 7 b c.jpg\n";
  for (const char* observations :
       {"", "\n", "1 2 -1\n", "12.5 nan -1 3.0 4.0 7\n", "1 -nan(ind) -1\n",
        "1 -nan -1 +2 inf 5 1.#QNAN -1.#IND00 -1\n", "1 2 3 4 5 6 7 8 9 10 11 12\n", "1 2 -1 3 4 -1 5 6 -1 nan 7 -1\n",
        "12,5 3,4 -1\n", "1 2 broken\n", "# none\n", "# of this image:\n1 2 -1\n", " \t \n"}) {
    CAPTURE(observations);
    CHECK(names_of(parsed(parse_colmap_images_text, a + observations + b + observations)) == Names{"a.jpg", "b c.jpg"});
  }
  // Lines of observations that an exporter left out, before names that look like numbers.
  CHECK(names_of(parsed(parse_colmap_images_text, "3 1 0 0 0 1 2 3 7 0001\n4 1 0 0 0 1 2 3 7 0002\n")) ==
        Names{"0001", "0002"});
  Findings findings;
  CHECK(names_of(parsed(parse_colmap_images_text, a + "4 1 x 0 0 1 2 3 7 b.jpg\n" + "5 1 0 0 0 1 2 3 7 c\n",
                        findings)) == Names{"a.jpg", "c"});
  CHECK(findings.lines() ==
        Names{"file: left out 1 photograph: its quaternion is not a usable number; correct or export "
              "the file again: b.jpg"});
}

TEST_CASE("COLMAP text as programs write it", "[scene][colmap]") {
  const auto turned = [](std::string text, const std::string& from, const std::string& to) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
    return text;
  };
  const std::string images = turned(images_text, "\r", ""), cameras = turned(cameras_text, "\r", "");
  const std::string mark = "\xef\xbb\xbf";
  for (const std::string end : {"\n", "\r\n", "\r", "\r\r\n"}) {
    CAPTURE(end);
    check_cameras(parse_colmap_cameras_text(mark + turned(cameras, "\n", end), "file"));
    const auto read = parsed(parse_colmap_images_text, mark + turned(turned(images, "\n", end), " 0 ", "\t+0.0\t"));
    CHECK(names_of(read) == Names{"a/b c.jpg", "second.jpg", "third.jpg"});
    check_image(read.at(0));
    CHECK(parsed(parse_colmap_points_text, mark + turned(points_text, "\n", end)).positions.size() == 1);
  }
  check_cameras(parse_colmap_cameras_text(
      "1.0 PINHOLE 64.0 4.8e1 +50 51 31 25 # left\n" + cameras.substr(cameras.find("7 OP")), "file"));
  const PointCloud cloud = parsed(parse_colmap_points_text, "5 +1 2 3.0 10.0 20 30 +0.5 1 2.0 # wall\n\n");
  CHECK(cloud.positions == std::vector<glm::dvec3>{{1, 2, 3}});
  CHECK(cloud.seen_by.at(0) == std::vector<std::uint32_t>{1});
  CHECK(names_of(parsed(parse_colmap_images_text, "3 1 0 0 0 1 2 3 7 a #1.jpg # first\n\n4 1 0 0 0 1 2 3 7 b # c\n")) ==
        Names{"a #1.jpg", "b # c"});
  using namespace std::string_literals;
  CHECK(message(parse_colmap_images_text,
                "\xff\xfe"
                "1\0 \0"s) == "file: is text in UTF-16; save it as UTF-8");
  CHECK(message(parse_colmap_points_text,
                "1\0 \0"
                "2\0"s) == "file: is text in UTF-16; save it as UTF-8");
  CHECK(message(parse_colmap_cameras_text, "1\0\0\0"s) == "file: is text in UTF-32; save it as UTF-8");
}

TEST_CASE("bad images and points of COLMAP models are left out by name", "[scene][colmap]") {
  const std::string good = "4 1 0 0 0 0 0 0 1 good.jpg\n\n";
  const auto line_of = [&](const std::string& bad) {
    Findings findings;
    CHECK(names_of(parsed(parse_colmap_images_text, good + bad + "\n1 2 -1\n" + good, findings)) ==
          Names{"good.jpg", "good.jpg"});
    CHECK(findings.left_out("photographs") == 1);
    return findings.lines().at(0);
  };
  CHECK(line_of("3 nan 0 0 0 1 2 3 7 a.jpg") ==
        "file: left out 1 photograph: pose is not finite; remove the image or estimate its pose again: a.jpg");
  CHECK(line_of("3 0 0 0 0 1 2 3 7 a.jpg").find("quaternion is zero; ") != std::string::npos);
  CHECK(line_of("3 1 0 0 0 1 -inf 3 7 a.jpg").find("translation is not finite") != std::string::npos);
  CHECK(line_of("3 1 0 0 0 1 1e19 3 7 a.jpg").ends_with(": a.jpg"));
  CHECK(line_of("3 1 0 0 0 1 2 3 -1 a b.jpg")
            .ends_with("its camera id is not a usable number; correct or export the "
                       "file again: a b.jpg"));
  CHECK(line_of("3 1 0 0").ends_with("ends before its quaternion; correct or export the file again: line 3"));
  CHECK(line_of("3 1 0 0 0 1 2 3 7").ends_with("ends before its image name; correct or export the file again: line 3"));
  CHECK(line_of("3 1 0 0 0 1,5 2 3 7 a.jpg").find("with a decimal comma") != std::string::npos);
  CHECK(
      message(parse_colmap_images_text, "3 nan 0 0 0 1 2 3 7 a\n\n3 nan 0 0 0 1 2 3 7 b\n\n") ==
      "file: line 1: pose is not finite; remove the image or estimate its pose again (none of its 2 photographs can be "
      "used)");

  Findings findings;
  const PointCloud cloud =
      parsed(parse_colmap_points_text,
             points_text + "6 nan 0 0 1 2 3\ngarbage\n7 1e19 0 0 1 2 3 0\n8 1 2\n9 4 5 6 1 2 3 0.1\n", findings);
  CHECK(cloud.positions == std::vector<glm::dvec3>{{1, 2, 3}, {4, 5, 6}});
  CHECK(findings.left_out("points") == 4);
  CHECK(findings.lines().at(0) ==
        "file: left out 2 points: point is not finite or beyond 1e18; export the model again: line 3, line 5");

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto image = [nan](double w, const std::string& name) {
    return pack(std::uint32_t(3), w, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, std::uint32_t(7)) + name + '\0' +
           pack(std::uint64_t(1), 1.0, nan, std::int64_t(-1));
  };
  Findings binary;
  CHECK(names_of(parsed(parse_colmap_images_binary,
                        pack(std::uint64_t(4)) + image(1, "a") + image(nan, "b") + image(1, "") + image(1, "c"),
                        binary)) == Names{"a", "c"});
  CHECK(binary.lines() ==
        Names{"file: left out 1 photograph: pose is not finite; remove the image or estimate its pose "
              "again: b",
              "file: left out 1 photograph: has no name; export the model again: image 3"});
  CHECK(message(parse_colmap_images_binary, pack(std::uint64_t(1)) + image(nan, "b")) ==
        "file: b: pose is not finite; remove the image or estimate its pose again");
  const auto point = [](double x) {
    return pack(std::uint64_t(5), x, 2.0, 3.0, std::uint8_t(1), std::uint8_t(2), std::uint8_t(3), 0.5, std::uint64_t(1),
                std::int32_t(1), std::int32_t(2));
  };
  Findings points;
  CHECK(parsed(parse_colmap_points_binary, pack(std::uint64_t(3)) + point(nan) + point(1) + point(1e300), points)
            .positions == std::vector<glm::dvec3>{{1, 2, 3}});
  CHECK(points.left_out("points") == 2);
}

TEST_CASE("decimal commas and other separators are named", "[scene][colmap]") {
  const auto camera = [](const std::string& line) { return message(parse_colmap_cameras_text, line); };
  CHECK(camera("1 PINHOLE 64 48 60,0 60,0 32,0 24,0") ==
        "file: line 1: its parameters is '60,0', with a decimal comma; write decimal points (set the locale to C) and "
        "export the file again");
  for (const char* line : {"1,PINHOLE,64,48,60,60,32,24", "1;PINHOLE;64;48;60;60;32;24", "1, PINHOLE, 64, 48",
                           "1 PINHOLE 1'920 48 60 60 32 24",
                           "1 PINHOLE 1\xc2\xa0"
                           "920 48 60 60 32 24",
                           "1 PINHOLE 1,920.0 48 60 60 32 24"}) {
    CAPTURE(line);
    CHECK(camera(line).find("with separators in or behind it; ") != std::string::npos);
  }
  // Most lines have the problem, so that it is one of the file: the line that can be read is not what is meant.
  const std::string whole = "3 1 0 0 0 1 2 3 7 a.jpg\n\n";
  std::string commas;
  for (int i = 0; i < 3; ++i) commas += "3 0,5 0 0 0 1 2 3 7 b.jpg\n\n";
  CHECK(message(parse_colmap_images_text, whole + commas)
            .starts_with("file: line 3: its quaternion is '0,5', with a decimal comma; "));
}

TEST_CASE("a text model that is shorter than its header says is warned of", "[scene][colmap]") {
  Findings findings;
  const std::string images = "# Number of images: 2, mean observations per image: 0\n1 1 0 0 0 1 2 3 7 a.jpg\n\n";
  CHECK(parse_colmap_images_text(images, "file", findings).size() == 1);
  REQUIRE(findings.lines().size() == 1);
  CHECK(findings.lines()[0].starts_with("file: has 1 of the 2 images that its header states; "));
  Findings whole;
  CHECK(parse_colmap_images_text(images + "2 1 0 0 0 1 2 3 7 b.jpg\n\n", "file", whole).size() == 2);
  CHECK(whole.lines().empty());
}

TEST_CASE("points without tracks are points whose views are unknown", "[scene][colmap]") {
  Findings findings;
  PointCloud cloud = parse_colmap_points_text("1 0 0 1 255 0 0 0.1\n2 0 0 2 255 0 0 0.1\n", "file", findings);
  REQUIRE(cloud.seen_by.size() == 2);
  drop_empty_tracks(cloud);
  CHECK(cloud.seen_by.empty());
  cloud = parse_colmap_points_text("1 0 0 1 255 0 0 0.1 7 0\n2 0 0 2 255 0 0 0.1\n", "file", findings);
  drop_empty_tracks(cloud);
  CHECK(cloud.seen_by.size() == 2);
}
