// Tests colour profiles and EXIF data in all types of pictures.
#include <catch2/catch.hpp>

#include <lcms2.h>
#include <webp/encode.h>
#include <zlib.h>

#include <cmath>
#include <string>

#include "base/read_file.h"
#include "image/colour_profile.h"
#include "image/image_file.h"
#include "jpeg_of.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace std::string_literals;

namespace {

constexpr std::array<double, 8> kP3{0.3127, 0.3290, 0.680, 0.320, 0.265, 0.690, 0.150, 0.060};
constexpr std::array<double, 8> kSrgbPoints{0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06};

// ICC profile of these chromaticities with the curve of sRGB.
std::string icc_of(const std::array<double, 8>& c) {
  const cmsFloat64Number parameters[5]{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  cmsToneCurve* curve = cmsBuildParametricToneCurve(nullptr, 4, parameters);
  cmsToneCurve* const curves[3]{curve, curve, curve};
  const cmsCIExyY white{c[0], c[1], 1};
  const cmsCIExyYTRIPLE primaries{{c[2], c[3], 1}, {c[4], c[5], 1}, {c[6], c[7], 1}};
  cmsHPROFILE profile = cmsCreateRGBProfile(&white, &primaries, curves);
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string icc(size, '\0');
  cmsSaveProfileToMem(profile, icc.data(), &size);
  cmsCloseProfile(profile);
  cmsFreeToneCurve(curve);
  return icc;
}

double light_of(double value) { return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4); }
double value_of(double light) { return light <= 0.0031308 ? light * 12.92 : 1.055 * std::pow(light, 1 / 2.4) - 0.055; }

// Display P3 to sRGB, with the matrix of CSS Color Module Level 4 (w3.org), section 18.
std::array<int, 3> srgb_of_p3(const std::uint8_t* p) {
  const double r = light_of(p[0] / 255.0), g = light_of(p[1] / 255.0), b = light_of(p[2] / 255.0);
  const double light[3]{1.2249401 * r - 0.2249402 * g, -0.0420569 * r + 1.0420571 * g,
                        -0.0196376 * r - 0.0786361 * g + 1.0982735 * b};
  std::array<int, 3> result{};
  for (std::size_t c = 0; c < 3; ++c)
    result[c] = static_cast<int>(std::lround(255 * value_of(std::clamp(light[c], 0.0, 1.0))));
  return result;
}

Image ramp() {
  Image image{16, 16, {}};
  for (int i = 0; i < 256; ++i)
    image.rgba.insert(image.rgba.end(), {std::uint8_t(60 + i / 2), std::uint8_t(100 + i % 16 * 5), 90, 200});
  return image;
}

std::string chunk(const std::string& type, const std::string& content) {
  const auto big = [](std::size_t value) {
    std::string text;
    for (int shift = 24; shift >= 0; shift -= 8) text.push_back(static_cast<char>(value >> shift));
    return text;
  };
  const std::string body = type + content;
  return big(content.size()) + body +
         big(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())));
}

// Inserts chunks after IHDR, or before IEND.
std::string with_chunks(const std::string& png, const std::string& chunks, bool at_end = false) {
  std::string result = png;
  return result.insert(at_end ? png.size() - 12 : 33, chunks);
}

std::string packed_text(const std::string& text) {
  uLongf size = compressBound(static_cast<uLong>(text.size()));
  std::string result(size, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(text.data()),
           static_cast<uLong>(text.size()));
  return result.substr(0, size);
}

// APP2 segments with at most `most` bytes of a profile each.
std::string with_icc(std::string jpeg, const std::string& icc, std::size_t most, bool drop_last = false) {
  const std::size_t count = (icc.size() + most - 1) / most;
  std::string segments;
  for (std::size_t i = 0; i + (drop_last ? 1 : 0) < count; ++i) {
    const std::string part =
        "ICC_PROFILE\0"s + static_cast<char>(i + 1) + static_cast<char>(count) + icc.substr(i * most, most);
    segments += "\xff\xe2"s + static_cast<char>((part.size() + 2) >> 8) + static_cast<char>(part.size() + 2) + part;
  }
  return jpeg.insert(2, segments);
}

Image in_srgb(const std::string& content, std::vector<std::string>* notes = nullptr) {
  return decode_image(bytes_of(content), "photo", {1, true, notes});
}
Image stored(const std::string& content) { return decode_image(bytes_of(content), "photo"); }

void check_p3(const std::string& content) {
  const Image before = stored(content), after = in_srgb(content);
  REQUIRE(before.rgba.size() == after.rgba.size());
  int changed = 0;
  for (std::size_t i = 0; i < before.rgba.size(); i += 4) {
    const std::array<int, 3> expected = srgb_of_p3(&before.rgba[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(std::abs(expected[c] - after.rgba[i + c]) <= 1);
      changed = std::max(changed, std::abs(before.rgba[i + c] - after.rgba[i + c]));
    }
    CHECK(before.rgba[i + 3] == after.rgba[i + 3]);
  }
  CHECK(changed > 5);
}

std::string iccp(const std::string& icc) { return chunk("iCCP", "a name\0\0"s + packed_text(icc)); }

std::string riff_chunk(const std::string& type, const std::string& content) {
  std::string result = type;
  for (int shift = 0; shift < 32; shift += 8) result.push_back(static_cast<char>(content.size() >> shift));
  return result + content + (content.size() % 2 != 0 ? "\0"s : ""s);
}

// A WebP with these chunks around its pixels.
std::string webp_with(const Image& image, int flags, const std::string& before, const std::string& after) {
  std::uint8_t* bytes = nullptr;
  const std::size_t size =
      WebPEncodeLosslessRGBA(image.rgba.data(), image.width, image.height, 4 * image.width, &bytes);
  const std::string simple(reinterpret_cast<const char*>(bytes), size);
  WebPFree(bytes);
  std::string header = std::string(1, static_cast<char>(flags)) + "\0\0\0"s;
  for (const int side : {image.width - 1, image.height - 1})
    header += std::string(1, static_cast<char>(side)) + "\0\0"s;
  return riff_chunk("RIFF", "WEBP" + riff_chunk("VP8X", header) + before + simple.substr(12) + after);
}

const std::string kExif6 = "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0"s;

int orientation_of(const std::string& content) {
  const test::SceneFolder folder;
  folder.write("a", content);
  return image_size(folder.path() / "a").orientation;
}

}  // namespace

TEST_CASE("colours of Display P3 become sRGB in JPEG, PNG and WebP", "[image][colours]") {
  const Image image = ramp();
  const std::string icc = icc_of(kP3);
  check_p3(with_chunks(encode_png(image, "a"), iccp(icc)));
  check_p3(with_icc(test::jpeg_of(image), icc, 60000));
  check_p3(with_icc(test::jpeg_of(image), icc, 100));
  check_p3(webp_with(image, 0x30, riff_chunk("ICCP", icc), ""));
  check_p3(with_chunks(encode_png(image, "a"), chunk("cICP", "\x0c\x0d\0\x01"s)));
}

TEST_CASE("a profile that is sRGB leaves the pixels alone", "[image][colours]") {
  const std::string png = encode_png(ramp(), "a");
  const std::string icc = icc_of(kSrgbPoints);
  CHECK(in_srgb(with_chunks(png, iccp(icc))).rgba == stored(png).rgba);
  const std::string jpeg = test::jpeg_of(ramp());
  CHECK(in_srgb(with_icc(jpeg, icc, 60000)).rgba == stored(jpeg).rgba);
  // 1/2.2, as many programs write beside pixels in sRGB.
  CHECK(in_srgb(with_chunks(png, chunk("gAMA", "\0\0\xb1\x8f"s))).rgba == stored(png).rgba);
}

TEST_CASE("gAMA and cHRM of a PNG are used, but not beside sRGB", "[image][colours]") {
  const std::string png = encode_png(ramp(), "a"), linear = chunk("gAMA", "\0\x01\x86\xa0"s);
  const Image before = stored(png), after = in_srgb(with_chunks(png, linear));
  for (std::size_t i = 0; i < 64; ++i) {
    const double expected = i % 4 == 3 ? before.rgba[i] : 255 * value_of(before.rgba[i] / 255.0);
    CHECK(std::abs(after.rgba[i] - expected) <= 1.5);
  }
  CHECK(in_srgb(with_chunks(png, linear + chunk("sRGB", "\0"s))).rgba == before.rgba);
  std::string points;
  for (const double value : kP3) {
    const auto number = static_cast<std::uint32_t>(std::lround(value * 100000));
    for (int shift = 24; shift >= 0; shift -= 8) points.push_back(static_cast<char>(number >> shift));
  }
  check_p3(with_chunks(png, chunk("cHRM", points)));
  CHECK(test::message_of([&] {
          in_srgb(with_chunks(png, chunk("cICP", "\x09\x10\0\x01"s)));
        }).starts_with("photo: has high dynamic range (PQ)"));
}

TEST_CASE("a damaged colour profile changes nothing and is noted", "[image][colours]") {
  const std::string png = encode_png(ramp(), "a"), jpeg = test::jpeg_of(ramp()), icc = icc_of(kP3);
  const auto check = [](const std::string& damaged, const std::string& plain, const std::string& note) {
    std::vector<std::string> notes;
    CHECK(in_srgb(damaged, &notes).rgba == stored(plain).rgba);
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].starts_with(note));
  };
  check(with_chunks(png, chunk("iCCP", "a name\0\0 not packed"s)), png, "have a damaged colour profile");
  check(with_chunks(png, iccp("not a profile")), png, "have a damaged colour profile");
  check(with_icc(jpeg, icc, 100, true), jpeg, "lack a part of their colour profile");
}

TEST_CASE("Adobe RGB of a camera is known by its EXIF data", "[image][colours]") {
  // Directory, EXIF directory with ColorSpace 65535 and interoperability directory with R03.
  const std::string exif = "Exif\0\0II*\0\x08\0\0\0"s + "\x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0"s +
                           "\x02\0\x01\xa0\x03\0\x01\0\0\0\xff\xff\0\0\x05\xa0\x04\0\x01\0\0\0\x38\0\0\0\0\0\0\0"s +
                           "\x01\0\x01\0\x02\0\x04\0\0\0R03\0\0\0\0\0"s;
  std::string jpeg = test::jpeg_of(test::plain(8, 8, 90, 160, 90));
  const Image plain = stored(jpeg);
  const std::string segment = "\xff\xe1\0"s + static_cast<char>(exif.size() + 2) + exif;
  const Image image = in_srgb(jpeg.insert(2, segment));
  // Green of Adobe RGB is greener than that of sRGB can show.
  CHECK(image.rgba[0] + 20 < plain.rgba[0]);
  std::string other = jpeg;
  other[other.find("R03") + 2] = '8';
  CHECK(in_srgb(other).rgba == plain.rgba);
}

TEST_CASE("the EXIF orientation is read from PNG and WebP", "[image][exif]") {
  const std::string png = encode_png(ramp(), "a");
  CHECK(orientation_of(png) == 1);
  CHECK(orientation_of(with_chunks(png, chunk("eXIf", kExif6))) == 6);
  CHECK(orientation_of(with_chunks(png, chunk("eXIf", kExif6), true)) == 6);
  std::string hex = "\nexif\n      32\n457869660000";
  for (const char c : kExif6) hex += fmt::format("{:02x}{}", static_cast<unsigned char>(c), c == '*' ? "\n" : "");
  const std::string keyword = "Raw profile type exif\0"s;
  CHECK(orientation_of(with_chunks(png, chunk("tEXt", keyword + hex))) == 6);
  CHECK(orientation_of(with_chunks(png, chunk("zTXt", keyword + "\0"s + packed_text(hex)))) == 6);
  CHECK(orientation_of(with_chunks(png, chunk("zTXt", keyword + "\0 damaged"s))) == 1);
  CHECK(orientation_of(webp_with(ramp(), 0x18, "", riff_chunk("EXIF", kExif6))) == 6);
  CHECK(orientation_of(webp_with(ramp(), 0x10, "", "")) == 1);
}
