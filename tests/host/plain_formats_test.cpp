// Tests BMP, GIF, TGA, PSD and the PBM family (engine/image/plain_formats.h), and HEIC.
#include <catch2/catch.hpp>

#include <string>

#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace std::string_literals;
using Catch::Matchers::Contains;

namespace {

// Two rows of two pixels: red, green; blue, white.
const std::string kRed = "\xff\0\0"s, kGreen = "\0\xff\0"s, kBlue = "\0\0\xff"s, kWhite = "\xff\xff\xff"s;

std::string message(const std::string& content, const std::string& name = "photo") {
  return test::message_of([&] { decode_image(bytes_of(content), name); });
}

std::string little(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text.push_back(static_cast<char>(i < 4 ? value >> 8 * i : 0));
  return text;
}

std::string big(std::uint32_t value, int bytes) {
  const std::string text = little(value, bytes);
  return {text.rbegin(), text.rend()};
}

void check_colours(const std::string& content) {
  const Image image = decode_image(bytes_of(content), "photo");
  CHECK((image.width == 2 && image.height == 2));
  const std::string expected = kRed + "\xff" + kGreen + "\xff" + kBlue + "\xff" + kWhite + "\xff";
  CHECK(std::string(image.rgba.begin(), image.rgba.end()) == expected);
  const test::SceneFolder folder;
  folder.write("a", content);
  CHECK(image_size(folder.path() / "a").width == 2);
}

void check_cuts(const std::string& content) {
  for (std::size_t size = 0; size < content.size(); ++size) {
    INFO(size << " of " << content.size());
    CHECK_FALSE(message(content.substr(0, size)).empty());
  }
}

// rows: with their padding, in the order of the file.
std::string bmp(int height, int bits, int compression, const std::string& palette, const std::string& rows) {
  return "BM" + little(0, 8) + little(54 + std::uint32_t(palette.size()), 4) + little(40, 4) + little(2, 4) +
         little(std::uint32_t(height), 4) + little(1, 2) + little(std::uint32_t(bits), 2) +
         little(std::uint32_t(compression), 4) + little(0, 20) + palette + rows;
}

// Blue first.
const std::string kTop = kBlue + kGreen, kBottom = kRed + kWhite;

std::string tga(int type, int flags, const std::string& pixels, int bits = 24) {
  return little(0, 2) + little(std::uint32_t(type), 1) + little(0, 9) + little(2, 2) + little(2, 2) +
         little(std::uint32_t(bits), 1) + little(std::uint32_t(flags), 1) + pixels;
}

std::string psd(int mode, int compression, const std::string& resources, const std::string& pixels) {
  return "8BPS\0\x01"s + big(0, 6) + big(3, 2) + big(2, 4) + big(2, 4) + big(8, 2) + big(std::uint32_t(mode), 2) +
         big(0, 4) + big(std::uint32_t(resources.size()), 4) + resources + big(0, 4) +
         big(std::uint32_t(compression), 2) + pixels;
}

}  // namespace

TEST_CASE("BMP is read", "[image][plain]") {
  const std::string up = bmp(2, 24, 0, "", kBottom + "\0\0"s + kTop + "\0\0"s);
  check_colours(up);
  check_colours(bmp(-2, 24, 0, "", kTop + "\0\0"s + kBottom + "\0\0"s));
  const std::string palette = kBlue + "\0"s + kGreen + "\0"s + kRed + "\0"s + kWhite + "\0"s;
  const std::string indexed = bmp(2, 8, 0, palette, "\x02\x03\0\0\0\x01\0\0"s);
  check_colours(indexed);
  check_cuts(up);
  check_cuts(indexed);
  CHECK_THAT(message(bmp(2, 8, 0, palette, "\x02\x04\0\0\0\x01\0\0"s)), Contains("lacks colours of its palette"));
  CHECK_THAT(message(bmp(2, 8, 1, palette, "\x02\x03\0\0\0\x01\0\0"s)), Contains("run-length coding"));
}

TEST_CASE("PPM, PGM and PBM are read", "[image][plain]") {
  const std::string bytes = "P6\n# a comment\n2 2\n255\n" + kRed + kGreen + kBlue + kWhite;
  check_colours(bytes);
  check_cuts(bytes);
  check_colours("P3 2 2 100 100 0 0 0 100 0 0 0 100 100 100 100");
  check_colours("P6 2 2 65535 \xff\xff\0\0\0\0\0\0\xff\xff\0\0\0\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff"s);
  const auto levels = [&](const std::string& content) {
    const Image image = decode_image(bytes_of(content), "photo");
    std::vector<int> result;
    for (std::size_t i = 1; i < image.rgba.size(); i += 4) result.push_back(image.rgba[i]);
    return result;
  };
  CHECK(levels("P5 3 1 255 \x01\x02\x03") == std::vector<int>{1, 2, 3});
  CHECK(levels("P2 3 1 4 0 2 4") == std::vector<int>{0, 128, 255});
  CHECK(levels("P4 9 1\n\x80\x80") == std::vector<int>{0, 255, 255, 255, 255, 255, 255, 255, 0});
  CHECK(levels("P1 3 1 101") == std::vector<int>{0, 255, 0});
  CHECK_THAT(message("P2 3 1 4 0 2 x      "), Contains("damaged or cut off"));
  CHECK_THAT(message("P2 3 1 4 0 2 5      "), Contains("damaged or cut off"));
  CHECK_THAT(message("P5 30000 30000 255 "), Contains("exceed the limit"));
}

TEST_CASE("TGA is read if it says where its first row is", "[image][plain]") {
  const std::string top = tga(2, 0x20, kTop + kBottom);
  check_colours(top);
  check_cuts(top);
  const std::string runs = tga(10, 0x20, "\x01" + kTop + "\x80" + kRed + "\x80" + kWhite);
  check_colours(runs);
  check_cuts(runs);
  // Alpha without meaning.
  check_colours(tga(2, 0x20, kBlue + "\0"s + kGreen + "\0"s + kRed + "\0"s + kWhite + "\0"s, 32));
  CHECK_THAT(message(tga(2, 0, kTop + kBottom), "a.tga"), Contains("first row may be at the top or at the bottom"));
}

TEST_CASE("PSD is read if it has three channels and the merged picture", "[image][plain]") {
  const std::string planes = "\xff\0\0\xff"s + "\0\xff\0\xff"s + "\0\0\xff\xff"s;
  check_colours(psd(3, 0, "", planes));
  check_cuts(psd(3, 0, "", planes));
  std::string packed = std::string("\0\x03\0\x03\0\x03\0\x03\0\x03\0\x03", 12);
  for (std::size_t i = 0; i < planes.size(); i += 2) packed += "\x01" + planes.substr(i, 2);
  check_colours(psd(3, 1, "", packed));
  check_cuts(psd(3, 1, "", packed));
  CHECK_THAT(message(psd(4, 0, "", planes)), Contains("other than three channels of 8 bits"));
  const std::string version = "8BIM" + big(1057, 2) + big(0, 2) + big(5, 4) + "\0\0\0\x01\0\0"s;
  CHECK_THAT(message(psd(3, 0, version, planes)), Contains("without the merged picture"));
}

TEST_CASE("the first picture of a GIF is read", "[image][plain]") {
  // Codes of 3 bits: clear, then the four colours, each after a clear code, then the end.
  const std::string head = "GIF89a" + little(2, 2) + little(2, 2) + "\x81\0\0"s + kRed + kGreen + kBlue + kWhite;
  const std::string data = "\x02\x04\x04\x43\x71\x05\0"s;
  const auto gif = [&](int width) {
    return head + "," + little(0, 4) + little(std::uint32_t(width), 2) + little(2, 2) + "\0"s + data;
  };
  CHECK_THAT(message(gif(1) + ";"), Contains("does not fill it"));
  CHECK_THAT(message(head + ";"), Contains("holds no picture"));
  check_cuts(gif(2));
  check_colours(gif(2) + ";");
}

TEST_CASE("types that are not read are named with their converter", "[image][plain]") {
  CHECK(message("\0\0\0\x0cJXL \r\n\x87\n"s) == "photo: JPEG XL is not read; convert with djxl IN OUT.png");
  CHECK_THAT(message("anything", "a.exr"), Contains("a.exr: OpenEXR is not read; "));
}

TEST_CASE("HEIC and AVIF are read with libheif, or named", "[image][heif]") {
  for (const std::string name : {"small.heic", "small.avif"}) {
    const std::string path = TRISOUP_SOURCE_DIR "/tests/fuzz/corpus/image_file/" + name;
    const std::string content = read_file(path);
    if (!is_readable_picture_name(name)) {
      CHECK_THAT(message(content), Contains("heif-convert IN OUT"));
      continue;
    }
    const Image image = decode_image(bytes_of(content), "photo");
    REQUIRE((image.width == 16 && image.height == 8));
    CHECK(image_size(path).width == 16);
    CHECK((std::abs(image.rgba[0] - 0xd0) < 24 && std::abs(image.rgba[2] - 0x10) < 24 && image.rgba[3] == 255));
    CHECK_FALSE(message(content.substr(0, content.size() - 30)).empty());
  }
}
