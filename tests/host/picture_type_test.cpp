// Tests engine/image/picture_type.h.
#include <catch2/catch.hpp>

#include <string>

#include "base/read_file.h"
#include "image/picture_type.h"

using namespace trisoup;
using namespace std::string_literals;

namespace {

std::string type_of(const std::string& content, const std::string& name = "x") {
  const PictureType* type = picture_type(bytes_of(content), name);
  return type != nullptr ? std::string(type->name) + (type->read ? "" : ", not read") : "unknown";
}

std::string tiff_with(std::uint16_t tag) {
  std::string tiff = "II*\0\x08\0\0\0\x01\0"s;
  for (const int byte : {tag & 255, tag >> 8, 4, 0, 1, 0, 0, 0, 1, 0, 0, 0}) tiff.push_back(static_cast<char>(byte));
  return tiff;
}

}  // namespace

TEST_CASE("pictures are recognised by their content", "[image][picture_type]") {
  CHECK(type_of("\x89PNG\r\n\x1a\n...") == "PNG");
  CHECK(type_of("\xff\xd8\xff\xe1") == "JPEG");
  CHECK(type_of("GIF89a") == "GIF");
  CHECK(type_of("P6\n2 2\n255\n") == "PPM");
  CHECK(type_of("BM0123456789ab\x28\0\0\0"s) == "BMP");
  CHECK(type_of("8BPS\0\x01"s) == "PSD");
  CHECK(type_of("\xff\x0a") == "JPEG XL, not read");
  CHECK(type_of("\0\0\0\x0cJXL \r\n\x87\n"s) == "JPEG XL, not read");
  CHECK(type_of("\0\0\0\x0cjP  \r\n\x87\n"s) == "JPEG 2000, not read");
  CHECK(type_of("v/1\x01") == "OpenEXR, not read");
  CHECK(type_of("#?RADIANCE\n") == "Radiance HDR, not read");
  CHECK(type_of("PF\n2 2\n-1.0\n") == "PFM, not read");
  CHECK(type_of("FUJIFILMCCD-RAW 0201") == "Fujifilm RAF, not read");
  CHECK(type_of("\0\0\0\x18"
                "ftypcrx \0\0\0\x01"
                "crx isom"s) == "Canon CR3, not read");
  CHECK(type_of("\0\0\0\x18"
                "ftypisom\0\0\0\x01"
                "isommp41"s) == "video (MP4, MOV), not read");
  CHECK(type_of("<?xml version='1.0'?>\n<svg/>") == "SVG, not read");
  CHECK(type_of(" <!DOCTYPE html><html>") == "web page, not read");
  CHECK(type_of("version https://git-lfs.github.com/spec/v1\n") == "Git LFS pointer, not read");
  for (const char* brand : {"heic", "mif1", "avif"}) {
    const std::string content =
        "\0\0\0\x10"
        "ftyp"s +
        brand + "\0\0\0\0"s;
    CHECK(type_of(content).starts_with(brand[0] == 'a' ? "AVIF" : "HEIC"));
  }
  CHECK(type_of("BM not an image") == "unknown");
  CHECK(type_of("") == "unknown");
}

TEST_CASE("raw photographs are told from TIFF", "[image][picture_type]") {
  CHECK(type_of(tiff_with(256)) == "TIFF");
  CHECK(type_of(tiff_with(50706)) == "DNG, not read");
  CHECK(type_of(tiff_with(256), "x.NEF") == "Nikon NEF, not read");
  CHECK(type_of("II*\0\x10\0\0\0CR\x02\0"s) == "Canon CR2, not read");
  CHECK(type_of("\xff\xd8\xff\xe1", "x.nef") == "JPEG");
}

TEST_CASE("pictures are recognised by their names", "[image][picture_type]") {
  for (const char* name : {"a.png", "a.JPG", "b/c.jfif", "a.Bmp", "a.ppm", "a.tif"})
    CHECK(is_readable_picture_name(name));
  for (const char* name : {"a.exr", "a.CR2", "a.dng", "a.jxl"}) {
    CHECK_FALSE(is_readable_picture_name(name));
    CHECK(is_unread_picture_name(name));
    CHECK_FALSE(picture_converter(name).empty());
  }
  for (const char* name : {"a.txt", "png", ".png", "a", "a.svg"}) {
    CHECK_FALSE(is_readable_picture_name(name));
    CHECK_FALSE(is_unread_picture_name(name));
  }
  CHECK(is_readable_picture_name("a.heic") != is_unread_picture_name("a.heic"));  // depends on the build
  CHECK(picture_converter("a.jxl") == "convert with djxl IN OUT.png");
  CHECK(picture_converter("a.png").empty());
  CHECK(readable_picture_extensions().front() == ".png");
}
