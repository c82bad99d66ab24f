// Tests reading pictures of numbers (engine/image/npy_file.cpp, read_values).
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include <tiffio.h>

#include "image/image_file.h"
#include "number_files.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using test::npy_of;
using test::png_16_of;
using test::SceneFolder;

namespace {

ValueMap decoded(const std::string& file) { return decode_values(std::as_bytes(std::span(file)), "map"); }

std::string refusal(const std::string& file) {
  return test::message_of([&] { decoded(file); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

const std::vector<float> kSix{0, 1.5f, 2, 3, -4, std::numeric_limits<float>::infinity()};

}  // namespace

TEST_CASE("numbers are read from .npy as stored", "[values]") {
  const ValueMap map = decoded(npy_of(kSix, 3));
  CHECK(map.width == 3);
  CHECK(map.height == 2);
  CHECK(map.numbers == ValueMap::Numbers::real);
  CHECK(map.values == kSix);
}

TEST_CASE("numbers of other types are read from .npy", "[values]") {
  std::string halves = replaced(npy_of({0, 0, 0}, 3), "<f4", "<f2");
  halves.resize(128);
  halves += std::string("\x00\x3c\x00\xc4\x01\x00", 6);
  CHECK(decoded(halves).values == std::vector<float>{1, -4, std::ldexp(1.0f, -24)});
  std::string whole = replaced(npy_of({0, 0}, 2), "<f4", "<u2");
  whole.resize(128);
  whole += std::string("\xe8\x03\xff\xff", 4);
  CHECK(decoded(whole).values == std::vector<float>{1000, 65535});
  CHECK(decoded(whole).numbers == ValueMap::Numbers::whole);
  CHECK(decoded(replaced(npy_of(kSix, 3), "(2, 3), ", "(1,2,3) ")).height == 2);
}

TEST_CASE("a .npy file that cannot be read is named with the reason", "[values]") {
  const std::string good = npy_of(kSix, 3);
  CHECK(refusal(good.substr(0, good.size() - 1)).find("map: is cut off, 3 x 2 numbers") == 0);
  CHECK(refusal(good.substr(0, 60)).find("cut off in its header") != std::string::npos);
  CHECK(refusal(replaced(good, "<f4", ">f4")).find("numbers are '>f4'; write it with numpy.save of float32") !=
        std::string::npos);
  CHECK(refusal(replaced(good, "False", "True ")).find("numpy.ascontiguousarray") != std::string::npos);
  CHECK(refusal(replaced(good, "(2, 3)", "(6,)  ")).find("height x width") != std::string::npos);
  CHECK(refusal(replaced(good, "(2, 3), ", "(0, 30) ")).find("claims 30 x 0") != std::string::npos);
  CHECK(refusal("nothing").find("map: ") == 0);
}

TEST_CASE("a PNG of 16 bits keeps all of them", "[values]") {
  const ValueMap map = decoded(png_16_of({0, 1, 256, 65535}, 2));
  CHECK(map.values == std::vector<float>{0, 1, 256, 65535});
  CHECK(map.numbers == ValueMap::Numbers::whole);
  const std::string file = png_16_of({0, 1, 256, 65535}, 2);
  CHECK(refusal(file.substr(0, file.size() - 20)).find("map: ") == 0);
}

TEST_CASE("a PNG of 8 bits must be grey to be numbers", "[values]") {
  const SceneFolder folder;
  folder.write("grey.png", test::plain(2, 2, 7, 7, 7));
  folder.write("red.png", test::plain(2, 2, 9, 7, 7));
  CHECK(read_values(folder / "grey.png").values == std::vector<float>(4, 7));
  CHECK(read_values(folder / "grey.png").numbers == ValueMap::Numbers::bits_8);
  CHECK(test::message_of([&] { read_values(folder / "red.png"); }).find("shows colours") != std::string::npos);
}

TEST_CASE("a TIFF of floats is read as numbers", "[values]") {
  const SceneFolder folder;
  TIFF* file = TIFFOpen((folder / "map.tif").c_str(), "w");
  REQUIRE(file != nullptr);
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, 3);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, 1);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, 32);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  std::vector<float> row{0.5f, 2, 1e6f};
  TIFFWriteScanline(file, row.data(), 0, 0);
  TIFFClose(file);
  CHECK(read_values(folder / "map.tif").values == row);
}
