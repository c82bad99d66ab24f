// Tests engine/scene/formats/ply_points.h.
#include <catch2/catch.hpp>

#include <limits>

#include "base/error.h"
#include "base/read_file.h"
#include "packed.h"
#include "scene/formats/ply_points.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

using test::pack;

namespace {

const std::string colour_properties = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
const std::string position_properties = "property float x\nproperty float y\nproperty float z\n";

PointCloud parse(const std::string& content, Findings& findings) {
  return parse_ply_points(bytes_of(content), "p.ply", findings);
}
PointCloud parse(const std::string& content) {
  Findings findings;
  return parse(content, findings);
}
std::string ply_message(const std::string& content) {
  return test::message_of([&] { parse(content); });
}

}  // namespace

TEST_CASE("ASCII and binary PLY give the same points", "[scene][ply]") {
  const std::string ascii = "ply\r\nformat ascii 1.0\r\ncomment made up\r\nelement vertex 2\r\n" + position_properties +
                            colour_properties +
                            "element face 1\nproperty list uchar int vertex_indices\nend_header\r\n" +
                            "1 2 3 10 20 30\n\n-4 5e-1 6 255 0 1\n3 0 1 1\n";
  const std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement camera 2\nproperty double f\nelement vertex 2\n" +
      colour_properties + "property double nx\n" + position_properties + "end_header\n" + pack(1.0, 2.0) +
      pack(std::uint8_t(10), std::uint8_t(20), std::uint8_t(30), 9.0, 1.0f, 2.0f, 3.0f) +
      pack(std::uint8_t(255), std::uint8_t(0), std::uint8_t(1), 9.0, -4.0f, 0.5f, 6.0f) + "more";
  for (const PointCloud& cloud : {parse(ascii), parse(binary)}) {
    CHECK(cloud.positions == std::vector<glm::dvec3>{{1, 2, 3}, {-4, 0.5, 6}});
    CHECK(cloud.colours == std::vector<glm::u8vec3>{{10, 20, 30}, {255, 0, 1}});
  }
}

TEST_CASE("PLY with other colour types or without colours", "[scene][ply]") {
  const PointCloud floats =
      parse("ply\nformat ascii 1.0\nelement vertex 1\n" + position_properties +
            "property float red\nproperty float green\nproperty ushort blue\nend_header\n1 2 3 1.0 0.5 65535\n");
  CHECK(floats.colours == std::vector<glm::u8vec3>{{255, 128, 255}});
  const PointCloud none =
      parse("ply\nformat ascii 1.0\nelement vertex 1\n" + position_properties + "end_header\n1 2 3\n");
  CHECK(none.colours.empty());
  CHECK(none.positions.size() == 1);
  CHECK(parse("ply\nformat ascii 1.0\nelement vertex 0\n" + position_properties + "end_header\n").positions.empty());
}

TEST_CASE("errors of PLY files name the problem and the fix", "[scene][ply]") {
  const std::string start = "ply\nformat ascii 1.0\nelement vertex 2\n";
  CHECK(ply_message("").find("ends inside the PLY header") != std::string::npos);
  CHECK(ply_message("plx\n") == "p.ply: does not start with 'ply'; give a PLY file");
  CHECK(ply_message("ply\nformat binary_big_endian 1.0\n") ==
        "p.ply: format binary_big_endian; export the points as ascii or binary_little_endian");
  CHECK(ply_message("ply\nelement vertex 2\n" + position_properties + "end_header\n").find("names no format") !=
        std::string::npos);
  CHECK(ply_message(start + "property float x\nproperty float y\nend_header\n1 2\n").find("no x, y, z") !=
        std::string::npos);
  CHECK(ply_message("ply\nformat ascii 1.0\nend_header\n").find("no element vertex") != std::string::npos);
  CHECK(ply_message("ply\nproperty float x\n").find("before any element") != std::string::npos);
  CHECK(ply_message(start + "property quad x\n") ==
        "p.ply: line 4: unknown property type 'quad'; export the points again");
  CHECK(ply_message(start + "property list uchar int x\nend_header\n").find("contains lists") != std::string::npos);
  CHECK(ply_message(start + position_properties + "end_header\n1 2 3\n").find("ends before its last point") !=
        std::string::npos);
  CHECK(ply_message(start + position_properties + "end_header\n1 2\n1 2\n") ==
        "p.ply: ends before its vertex values; correct or export the file again (none of its 2 points can be used)");
  CHECK(ply_message(start + position_properties + "end_header\n1 2 inf\n1 2 nan\n").find("point 0 is not finite") !=
        std::string::npos);
  CHECK(ply_message(start + position_properties + "end_header\n1,5 2 3\n1 2 3\n").find("with a decimal comma") !=
        std::string::npos);
  CHECK(ply_message("ply\nformat ascii 1.0\nelement vertex 18446744073709551615\n" + position_properties +
                    "end_header\n1 2 3\n")
            .find("ends before") != std::string::npos);
  const std::string binary = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + position_properties +
                             "end_header\n" + pack(1.0f, 2.0f, 3.0f);
  REQUIRE(ply_message(binary).empty());
  for (std::size_t size = 0; size < binary.size(); ++size)
    CHECK(ply_message(binary.substr(0, size)).starts_with("p.ply: "));
}

TEST_CASE("bad points of a PLY file are left out", "[scene][ply]") {
  const std::vector<glm::dvec3> good{{1, 2, 3}, {4, 5, 6}};
  Findings ascii;
  CHECK(parse("ply\nformat ascii 1.0\nelement vertex 6\n" + position_properties + "property float quality\n" +
                  "end_header\n1 2 3 nan\nnan 2 3 0\n1 2\n1e30 1 1 0\nx 1 1 0\n+4 5 6 #VALUE!\n",
              ascii)
            .positions == good);
  CHECK(ascii.left_out("points") == 4);
  CHECK(ascii.lines().at(0) == "p.ply: left out 2 points: is not finite or beyond 1e18; remove it: point 1, point 3");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Findings binary;
  CHECK(parse("ply\nformat binary_little_endian 1.0\nelement vertex 3\n" + position_properties + "end_header\n" +
                  pack(1.0f, 2.0f, 3.0f, 1.0f, nan, 3.0f, 4.0f, 5.0f, 6.0f),
              binary)
            .positions == good);
  CHECK(binary.lines() ==
        std::vector<std::string>{"p.ply: left out 1 point: is not finite or beyond 1e18; remove it: point 1"});
}

TEST_CASE("PLY with a byte-order mark and with other line ends", "[scene][ply]") {
  const std::vector<glm::dvec3> good{{1, 2, 3}};
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    CAPTURE(end);
    const auto file = [&](const std::string& format) {
      std::string text = "ply\nformat " + format + " 1.0\nelement vertex 1\n" + position_properties + "end_header\n",
                  turned;
      for (const char c : text) turned += c == '\n' ? end : std::string(1, c);
      return "\xef\xbb\xbf" + turned;
    };
    CHECK(parse(file("ascii") + "1 2 3" + end).positions == good);
    CHECK(parse(file("binary_little_endian") + pack(1.0f, 2.0f, 3.0f)).positions == good);
    // 0x0a as the first byte of the data
    CHECK(parse(file("binary_little_endian") + pack(std::uint32_t(0x3f80000a), 2.0f, 3.0f)).positions.at(0).y == 2);
  }
  using namespace std::string_literals;
  CHECK(ply_message("\xff\xfep\0l\0y\0\n\0"s) == "p.ply: is text in UTF-16; save it as UTF-8");
}
