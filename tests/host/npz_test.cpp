// Tests tests/npz.h, which reads the NumPy files of the golden tests.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>

#include <zlib.h>

#include "base/error.h"
#include "npz.h"
#include "shared_data.h"
#include "temporary_folder.h"

using namespace trisoup;

namespace {

template <typename T>
void put(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Member {
  std::string name, npy;
  bool deflate = false;
};

std::string npy(const std::string& descr, const std::string& shape, const std::string& data) {
  std::string header = "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }";
  header.resize((10 + header.size() + 63) / 64 * 64 - 10, ' ');
  header.back() = '\n';
  std::string out("\x93NUMPY\1\0", 8);
  put(out, static_cast<std::uint16_t>(header.size()));
  return out + header + data;
}

template <typename T>
std::string bytes(std::initializer_list<T> values) {
  std::string out;
  for (const T value : values) put(out, value);
  return out;
}

std::string zip(const std::vector<Member>& members) {
  std::string file, directory;
  for (const Member& member : members) {
    std::string packed = member.npy;
    if (member.deflate) {
      packed.resize(member.npy.size() + 100);
      z_stream stream{};
      deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(member.npy.data()));
      stream.avail_in = static_cast<uInt>(member.npy.size());
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = static_cast<uInt>(packed.size());
      deflate(&stream, Z_FINISH);
      packed.resize(stream.total_out);
      deflateEnd(&stream);
    }
    const auto common = [&](std::string& to) {
      put<std::uint16_t>(to, 20), put<std::uint16_t>(to, 0), put<std::uint16_t>(to, member.deflate ? 8 : 0);
      put<std::uint32_t>(to, 0), put<std::uint32_t>(to, 0);
      put(to, static_cast<std::uint32_t>(packed.size())), put(to, static_cast<std::uint32_t>(member.npy.size()));
      put(to, static_cast<std::uint16_t>(member.name.size()));
    };
    const auto local = static_cast<std::uint32_t>(file.size());
    file += "PK\3\4";
    common(file);
    put<std::uint16_t>(file, 4);  // local headers of NumPy have an extra field that the directory lacks
    file += member.name + "xtra" + packed;
    directory += "PK\1\2";
    put<std::uint16_t>(directory, 20);
    common(directory);
    put<std::uint16_t>(directory, 0), put<std::uint16_t>(directory, 0), put<std::uint16_t>(directory, 0);
    put<std::uint16_t>(directory, 0), put<std::uint32_t>(directory, 0), put(directory, local);
    directory += member.name;
  }
  const auto start = static_cast<std::uint32_t>(file.size());
  file += directory + "PK\5\6";
  put<std::uint32_t>(file, 0);
  put(file, static_cast<std::uint16_t>(members.size())), put(file, static_cast<std::uint16_t>(members.size()));
  put(file, static_cast<std::uint32_t>(directory.size())), put(file, start), put<std::uint16_t>(file, 0);
  return file;
}

}  // namespace

TEST_CASE("npz arrays of every supported type", "[npz]") {
  const test::TemporaryFolder folder;
  const auto file = folder.file(
      "file.npz", zip({
                      {"f4.npy", npy("<f4", "(2, 3)", bytes<float>({1, 2, 3, 4, 5, 6.5f}))},
                      {"f8.npy", npy("<f8", "(1,)", bytes<double>({0.1})), true},
                      {"f2.npy", npy("<f2", "(5,)", bytes<std::uint16_t>({0x3c00, 0xc000, 0x0001, 0x7c00, 0x7e00}))},
                      {"i4.npy", npy("<i4", "()", bytes<std::int32_t>({-7})), true},
                      {"i8.npy", npy("<i8", "(2,)", bytes<std::int64_t>({-1, 2147483647}))},
                      {"u1.npy", npy("|u1", "(2,)", bytes<std::uint8_t>({0, 255}))},
                      {"u2.npy", npy("<u2", "(1,)", bytes<std::uint16_t>({65535}))},
                      {"none.npy", npy("<f4", "(0, 3)", "")},
                  }));
  test::Npz npz = test::load_npz(file);
  REQUIRE(npz.size() == 8);
  CHECK(npz["f4"].shape == std::vector<std::size_t>{2, 3});
  CHECK(npz["f4"].f == std::vector<float>{1, 2, 3, 4, 5, 6.5f});
  CHECK(npz["f8"].d == std::vector<double>{0.1});
  CHECK(npz["f8"].f == std::vector<float>{0.1f});
  CHECK(npz["f2"].f[0] == 1.0f);
  CHECK(npz["f2"].f[1] == -2.0f);
  CHECK(npz["f2"].f[2] == std::ldexp(1.0f, -24));
  CHECK(std::isinf(npz["f2"].f[3]));
  CHECK(std::isnan(npz["f2"].f[4]));
  CHECK(npz["i4"].shape.empty());
  CHECK(npz["i4"].elements() == 1);
  CHECK(npz["i4"].i == std::vector<std::int32_t>{-7});
  CHECK(npz["i8"].i == std::vector<std::int32_t>{-1, 2147483647});
  CHECK(npz["u1"].i == std::vector<std::int32_t>{0, 255});
  CHECK(npz["u2"].i == std::vector<std::int32_t>{65535});
  CHECK(npz["none"].elements() == 0);
}

TEST_CASE("npz: a truncated archive is an Error", "[npz]") {
  const test::TemporaryFolder folder;
  const std::string whole = zip({{"a.npy", npy("<f4", "(2,)", bytes<float>({1, 2})), true}});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto file = folder.file("file.npz", whole.substr(0, size));
    CHECK_THROWS_AS(test::load_npz(file), Error);
  }
  CHECK_THROWS_AS(test::load_npz("no/such/file.npz"), Error);
  const auto wide = folder.file("wide.npz", zip({{"a.npy", npy("<i8", "()", bytes<std::int64_t>({1ll << 40}))}}));
  CHECK_THROWS_AS(test::load_npz(wide), Error);
  const auto claims =
      folder.file("claims.npz", zip({{"a.npy", npy("<f4", "(2000000000, 2000000000)", bytes<float>({1, 2}))}}));
  CHECK_THROWS_AS(test::load_npz(claims), Error);
}

TEST_CASE("npz: the golden vectors are readable", "[npz][golden][same_code]") {
  REQUIRE_SHARED_FOLDER(shared);
  for (const auto& entry : std::filesystem::directory_iterator(shared / "golden"))
    if (entry.path().extension() == ".npz")
      for (const auto& [name, array] : test::load_npz(entry.path())) {
        INFO(entry.path().filename().string() << ":" << name);
        CHECK(array.f.size() + array.i.size() == array.elements());
      }
}
