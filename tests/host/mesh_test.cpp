// Tests engine/mesh/mesh.h: reading OBJ, PLY and glTF, and one-line errors for damaged files.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cstring>

#include "base/error.h"
#include "base/read_file.h"
#include "mesh/mesh.h"
#include "temporary_folder.h"

using namespace trisoup;
using namespace trisoup::soup;

namespace {

Mesh obj(const std::string& text) { return read_obj(bytes_of(text), "test.obj"); }
Mesh ply(const std::string& text) { return read_ply(bytes_of(text), "test.ply"); }
Mesh gltf(const std::string& text, const std::filesystem::path& folder = "/nonexistent") {
  return read_gltf(bytes_of(text), folder, "test.gltf");
}

template <typename Read>
std::string error_of_read(Read&& read) {
  try {
    read();
  } catch (const Error& error) {
    const std::string message = error.what();
    CHECK(message.find('\n') == std::string::npos);
    return message;
  }
  return "no error";
}

const std::vector<glm::vec3> kQuad{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.5f}, {0, 1, 0}};
const std::vector<std::uint32_t> kQuadFan{0, 1, 2, 0, 2, 3};

void check_quad(const Mesh& mesh) {
  CHECK(mesh.positions == kQuad);
  CHECK(mesh.indices == kQuadFan);
}

template <typename T>
void put(std::string& to, T value, bool big) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  if (big) std::reverse(raw, raw + sizeof value);
  to.append(raw, sizeof value);
}

const std::string kPlyAscii =
    "ply\r\nformat ascii 1.0\r\ncomment made by hand\r\nelement vertex 4\r\nproperty float x\r\nproperty float y\r\n"
    "property float z\r\nproperty uchar red\r\nelement face 1\r\nproperty list uchar int "
    "vertex_indices\r\nend_header\r\n"
    "0 0 0 255\r\n1 0 0 0\r\n1 1 0.5 0\r\n0 +1 0e0 0\r\n4 0 1 2 3\r\n";

std::string ply_binary(bool big) {
  std::string text =
      std::string("ply\nformat binary_") + (big ? "big" : "little") +
      "_endian 1.0\nelement face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\n"
      "element vertex 4\nproperty double x\nproperty float y\nproperty list ushort char odd\nproperty float z\n"
      "end_header\n";
  put<std::uint8_t>(text, 9, big);
  put<std::uint8_t>(text, 4, big);
  for (std::uint32_t k = 0; k < 4; ++k) put(text, k, big);
  for (const glm::vec3& p : kQuad) {
    put<double>(text, p.x, big), put<float>(text, p.y, big), put<std::uint16_t>(text, 2, big);
    text += "ab";
    put<float>(text, p.z, big);
  }
  return text;
}

// Two triangles (a strip of four corners) in two nested nodes. The buffer is base64 of 4 vec3 floats and 4 uint16.
const char* kBuffer = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAACAPwAAgD8AAAAAAAABAAIAAwA=";
std::string gltf_text(const std::string& buffer_uri, const std::string& more = "", const std::string& count = "4",
                      const std::string& child = "1") {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"translation":[10,0,0],"rotation":[0,0,0.7071067811865476,0.7071067811865476],
              "scale":[2,2,2],"children":[)" +
         child + R"(]},
             {"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":5},
                             {"attributes":{"POSITION":0},"mode":0}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":)" +
         count +
         R"(,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
                 {"bufferView":1,"componentType":5123,"count":4,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":8}],)" +
         more + R"("buffers":[{"byteLength":56,"uri":")" + buffer_uri + "\"}]}";
}
const std::string kDataUri = std::string("data:application/octet-stream;base64,") + kBuffer;

void check_strip(const Mesh& mesh) {
  CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3});
  REQUIRE(mesh.positions.size() == 4);
  // (x, y, z + 5), rotated by 90 degrees about z, scaled by 2, moved by 10 along x.
  CHECK(glm::distance(mesh.positions[0], glm::vec3(10, 0, 10)) < 1e-5f);
  CHECK(glm::distance(mesh.positions[1], glm::vec3(10, 2, 10)) < 1e-5f);
  CHECK(glm::distance(mesh.positions[2], glm::vec3(8, 0, 10)) < 1e-5f);
}

}  // namespace

TEST_CASE("OBJ: polygons, negative indices, groups and attributes", "[mesh]") {
  check_quad(
      obj("# quad\nmtllib no.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng a\nusemtl b\nf 1/1/1 2//1 "
          "3/1 4\n"));
  check_quad(obj("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf -4 -3 -2 -1\n"));
  check_quad(obj("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\no a\nf 1 2 3\no b\nf 1 3 4\n"));
}

TEST_CASE("OBJ: damage", "[mesh]") {
  using Catch::Matchers::Contains;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
  CHECK_THAT(error_of_read([&] { obj(vertices); }), Contains("test.obj: has no faces"));
  CHECK_THAT(error_of_read([&] { obj(""); }), Contains("no faces"));
  CHECK_THAT(error_of_read([&] { obj(vertices + "f 1 2 9\n"); }), Contains("test.obj"));
  CHECK_THAT(error_of_read([&] { obj(vertices + "f 1 2 0\n"); }), Contains("test.obj"));
  CHECK_THAT(error_of_read([&] { obj(vertices + "f 1 2 -9\n"); }), Contains("test.obj"));
  for (const char* number : {"nan", "inf", "1e999", "one"})
    CHECK_THAT(error_of_read([&] { obj(vertices + "v 0 " + number + " 1\nf 1 2 4\n"); }), Contains("test.obj: "));
  std::string many;
  for (int k = 1; k <= 300; ++k) many.append("v 0 0 ").append(std::to_string(k)).append("\n");
  many += "f";
  for (int k = 1; k <= 300; ++k) many.append(" ").append(std::to_string(k));
  CHECK_THAT(error_of_read([&] { obj(many + "\n"); }), Contains("255 corners"));
}

TEST_CASE("PLY: ascii and both binary orders", "[mesh]") {
  check_quad(ply(kPlyAscii));
  check_quad(ply(ply_binary(false)));
  check_quad(ply(ply_binary(true)));
}

TEST_CASE("PLY: damage", "[mesh]") {
  using Catch::Matchers::Contains;
  // The final line break of a text file is not needed.
  for (std::size_t size = 0; size + 3 < kPlyAscii.size(); ++size)
    CHECK_THAT(error_of_read([&] { ply(kPlyAscii.substr(0, size)); }), Contains("test.ply: "));
  for (std::size_t size = 0; size < ply_binary(true).size(); ++size)
    CHECK_THAT(error_of_read([&] { ply(ply_binary(true).substr(0, size)); }), Contains("test.ply: "));
  const auto with = [](const std::string& what, const std::string& instead) {
    std::string text = kPlyAscii;
    text.replace(text.find(what), what.size(), instead);
    return error_of_read([&] { ply(text); });
  };
  CHECK_THAT(with("4 0 1 2 3", "4 0 1 2 7"), Contains("vertex 7 of 4"));
  CHECK_THAT(with("4 0 1 2 3", "4 0 1 2 -1"), Contains("vertex index"));
  CHECK_THAT(with("4 0 1 2 3", "4 0 1 2 1.5"), Contains("vertex index"));
  CHECK_THAT(with("1 1 0.5 0", "1 nan 0.5 0"), Contains("vertex 2 has a coordinate that is not finite"));
  CHECK_THAT(with("1 1 0.5 0", "1 1e99 0.5 0"), Contains("coordinate that is not finite"));
  CHECK_THAT(with("1 1 0.5 0", "1 x 0.5 0"), Contains("not a number"));
  CHECK_THAT(with("property float y", "property float w"), Contains("have no y"));
  CHECK_THAT(with("1 1 0.5 0", "1 1e999 0.5 0"), Contains("coordinate that is not finite"));
  CHECK(ply(std::string(kPlyAscii).replace(kPlyAscii.find("1 1 0.5 0"), 9, "1 1e-999 0.5 0")).positions[2].y == 0.0f);
  CHECK_THAT(with("element face 1", "element face 0"), Contains("no faces"));
  CHECK_THAT(with("element vertex 4", "element vertex 4000000000"), Contains("ends before"));
  CHECK_THAT(with("4 0 1 2 3", "4000000000 0 1 2 3"), Contains("ends before"));
  CHECK_THAT(with("uchar red", "colour red"), Contains("line 8 of the header"));
  CHECK_THAT(with("format ascii 1.0", "comment"), Contains("no 'format'"));
}

TEST_CASE("glTF: nodes, strips, embedded and separate buffers, binary", "[mesh]") {
  check_strip(gltf(gltf_text(kDataUri)));
  check_strip(gltf(gltf_text(kDataUri, R"("images":[{"uri":"missing.png"}],"textures":[{"source":0}],)")));

  const test::TemporaryFolder folder;
  std::string buffer;
  for (const glm::vec3& p : {glm::vec3(0, 0, 0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(1, 1, 0)})
    for (int k = 0; k < 3; ++k) put<float>(buffer, p[k], false);
  for (std::uint16_t k = 0; k < 4; ++k) put(buffer, k, false);
  folder.file("mesh.bin", buffer);
  check_strip(read_mesh(folder.file("mesh.gltf", gltf_text("mesh.bin"))));

  std::string json = gltf_text("x");
  json.erase(json.find(",\"uri\":\"x\""), 10);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb = "glTF";
  put<std::uint32_t>(glb, 2, false);
  put<std::uint32_t>(glb, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()), false);
  put<std::uint32_t>(glb, static_cast<std::uint32_t>(json.size()), false);
  glb += "JSON" + json;
  put<std::uint32_t>(glb, static_cast<std::uint32_t>(buffer.size()), false);
  glb += std::string("BIN\0", 4) + buffer;
  check_strip(read_mesh(folder.file("mesh.GLB", glb)));
  for (std::size_t size = 0; size < glb.size(); size += 7)
    CHECK_THAT(error_of_read([&] { gltf(glb.substr(0, size)); }), Catch::Matchers::StartsWith("test.gltf: "));
}

TEST_CASE("glTF: damage", "[mesh]") {
  using Catch::Matchers::Contains;
  CHECK_THAT(error_of_read([&] { gltf(""); }), Contains("test.gltf: is damaged"));
  CHECK_THAT(error_of_read([&] { gltf("{}"); }), Contains("test.gltf: "));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text("missing.bin")); }), Contains("test.gltf: "));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text(kDataUri, "", "400")); }), Contains("outside its buffer"));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text(kDataUri, "", "3")); }), Contains("vertex 3 of 3"));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text(kDataUri, "", "4", "0")); }), Contains("two parents"));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text(kDataUri, "", "4", "7")); }), Contains("node 7 of 2"));
  CHECK_THAT(error_of_read([&] { gltf(gltf_text(kDataUri, "", "4", "")); }), Contains("no faces"));
}

TEST_CASE("mesh files that cannot be read", "[mesh]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  CHECK_THAT(error_of_read([&] { read_mesh(folder / "missing.obj"); }), Contains("missing.obj: cannot be opened"));
  CHECK_THAT(error_of_read([&] { read_mesh(folder.file("a.stl", "solid")); }), Contains("a.stl: unknown mesh format"));
  CHECK_THAT(error_of_read([&] { read_mesh(folder.file("a.ply", "")); }), Contains("a.ply: does not begin"));
  check_quad(read_mesh(folder.file("a.PLY", kPlyAscii)));
  check_quad(read_mesh(folder.file("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n")));
}
