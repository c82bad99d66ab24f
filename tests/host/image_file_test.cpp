// Tests engine/image/image_file.h: round trips, and detection of damage.
#include <catch2/catch.hpp>

#include <sys/resource.h>
#include <tiffio.h>
#include <webp/encode.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>

#include <jpeglib.h>

#include "base/error.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "image/tiff_directory.h"
#include "jpeg_of.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using test::jpeg_of;
using test::with_orientation;

namespace {

Image noise(int width, int height, bool opaque) {
  std::mt19937 random(3);
  Image image{width, height, {}};
  for (int i = 0; i < width * height * 4; ++i)
    image.rgba.push_back(opaque && i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random()));
  return image;
}

std::string webp_of(const Image& image) {
  std::uint8_t* bytes = nullptr;
  const std::size_t size =
      WebPEncodeLosslessRGBA(image.rgba.data(), image.width, image.height, 4 * image.width, &bytes);
  const std::string content(reinterpret_cast<const char*>(bytes), size);
  WebPFree(bytes);
  return content;
}

// A TIFF of 8 or 16 bits, RGB or RGBA with unassociated alpha.
std::string tiff_of(const Image& image, int bits, int channels, int compression, int orientation = 1) {
  const test::SceneFolder folder;
  const std::string path = (folder.path() / "a.tif").string();
  TIFF* tiff = TIFFOpen(path.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image.height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, channels);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
  TIFFSetField(tiff, TIFFTAG_ORIENTATION, orientation);
  const std::uint16_t unassociated = EXTRASAMPLE_UNASSALPHA;
  if (channels == 4) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &unassociated);
  for (int y = 0; y < image.height; ++y) {
    std::string row;
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < channels; ++c)
        for (int byte = 0; byte < bits / 8; ++byte)
          row.push_back(static_cast<char>(image.rgba[std::size_t(4 * (y * image.width + x) + c)]));
    TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), 0);
  }
  TIFFClose(tiff);
  return read_file(path);
}

std::string progressive_of(const Image& image) {
  jpeg_compress_struct info;
  jpeg_error_mgr errors;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = static_cast<JDIMENSION>(image.width);
  info.image_height = static_cast<JDIMENSION>(image.height);
  info.input_components = 4;
  info.in_color_space = JCS_EXT_RGBA;
  jpeg_set_defaults(&info);
  jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < image.height; ++y) {
    JSAMPROW row = const_cast<JSAMPROW>(&image.rgba[std::size_t(4 * y * image.width)]);
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  const std::string content(reinterpret_cast<const char*>(bytes), size);
  jpeg_destroy_compress(&info);
  std::free(bytes);
  return content;
}

std::string decode_message(const std::string& content) {
  return test::message_of([&] { decode_image(bytes_of(content), "photo"); });
}

}  // namespace

TEST_CASE("a PNG is read back unchanged", "[scene][image]") {
  const test::SceneFolder folder;
  const bool opaque = GENERATE(true, false);
  const Image image = noise(37, 21, opaque);
  const auto path = folder.path() / "a.png";
  write_png(path, test::plain(5, 5, 1, 2, 3));  // replaced below
  write_png(path, image);
  const Image back = read_image(path);
  CHECK(back.width == 37);
  CHECK(back.height == 21);
  CHECK(back.rgba == image.rgba);
  CHECK(image_size(path).width == 37);
  CHECK(image_size(path).height == 21);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);  // no temporary file left
}

TEST_CASE("a JPEG is decoded, also with an EXIF thumbnail and trailing bytes", "[scene][image]") {
  const std::string jpeg = jpeg_of(test::plain(40, 30, 200, 100, 50));
  const auto near_colour = [](const Image& image) {
    return image.width == 40 && image.height == 30 && std::abs(image.rgba[0] - 200) < 4 && image.rgba[3] == 255;
  };
  CHECK(near_colour(decode_image(bytes_of(jpeg), "photo")));
  CHECK(near_colour(decode_image(bytes_of(jpeg + "appended by a phone"), "photo")));
  std::string with_thumbnail = jpeg;
  with_thumbnail.insert(2, std::string("\xff\xe1\0\x08"
                                       "xx\xff\xd9xx",
                                       10));  // an APP1 segment with an end marker inside
  CHECK(near_colour(decode_image(bytes_of(with_thumbnail), "photo")));
  CHECK(decode_message(with_thumbnail.substr(0, with_thumbnail.size() - 30))
            .starts_with("photo: cut off before its end; "));
}

TEST_CASE("a truncated image is an Error of one line", "[scene][image]") {
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", noise(9, 7, false));
  const std::string png = read_file(folder.path() / "a.png"), jpeg = jpeg_of(noise(24, 24, true));
  const std::string webp = webp_of(noise(9, 7, false)),
                    tiff = tiff_of(noise(9, 7, true), 8, 3, COMPRESSION_ADOBE_DEFLATE);
  for (const std::string& whole : {png, jpeg, webp, tiff}) {
    REQUIRE(decode_message(whole).empty());
    // A JPEG that lacks only its end marker is read.
    const std::size_t needed = whole.size() - (whole == jpeg ? 2 : 0);
    for (std::size_t size = 0; size < needed; ++size) {
      const std::string message = decode_message(whole.substr(0, size));
      INFO(size << " of " << whole.size());
      CHECK(message.starts_with("photo: "));
      CHECK(message.find('\n') == std::string::npos);
    }
  }
}

TEST_CASE("a JPEG that lacks only its end marker is read with a note", "[scene][image]") {
  const std::string jpeg = jpeg_of(noise(24, 24, true));
  const Image whole = decode_image(bytes_of(jpeg), "photo");
  for (const int missing : {1, 2})
    for (const int divisor : {1, 2}) {
      CAPTURE(missing, divisor);
      std::vector<std::string> notes;
      const std::string cut = jpeg.substr(0, jpeg.size() - std::size_t(missing));
      const Image image = decode_image(bytes_of(cut), "photo", {divisor, false, &notes});
      if (divisor == 1) CHECK(image.rgba == whole.rgba);
      REQUIRE(notes.size() == 1);
      CHECK(notes[0].starts_with("lack the end marker of a JPEG"));
    }
  std::vector<std::string> notes;
  decode_image(bytes_of(jpeg), "photo", {1, false, &notes});
  CHECK(notes.empty());
}

TEST_CASE("a progressive JPEG that lacks its last scans is an Error", "[scene][image]") {
  const std::string jpeg = progressive_of(noise(24, 24, true));
  std::vector<std::size_t> scans;
  for (std::size_t at = jpeg.find("\xff\xda"); at != std::string::npos; at = jpeg.find("\xff\xda", at + 1))
    scans.push_back(at);
  REQUIRE(scans.size() > 3);
  CHECK(decode_message(jpeg.substr(0, jpeg.size() - 2)).empty());
  for (std::size_t i = 1; i < scans.size(); ++i) CHECK_FALSE(decode_message(jpeg.substr(0, scans[i])).empty());
}

TEST_CASE("a JPEG whose Huffman table overflows is refused", "[scene][image]") {
  std::string jpeg = jpeg_of(noise(24, 24, true));
  const std::size_t table = jpeg.find("\xff\xc4");
  REQUIRE(table != std::string::npos);
  jpeg[table + 5] = jpeg[table + 6] = '\xff';  // 510 codes; 256 are possible
  CHECK(decode_message(jpeg) == "photo: has an impossible Huffman table; copy or export the image again");
}

TEST_CASE("a changed PNG is detected by its checksum", "[scene][image]") {
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", noise(9, 7, false));
  std::string png = read_file(folder.path() / "a.png");
  png[60] = static_cast<char>(png[60] ^ 1);
  CHECK(decode_message(png) == "photo: has a wrong checksum; copy or export the image again");
}

TEST_CASE("unknown formats and invalid sizes are Errors", "[scene][image]") {
  CHECK(decode_message("") == "photo: is empty; copy or export the image again");
  CHECK(decode_message("BM not an image") ==
        "photo: not a picture of a known type, or its header is damaged; convert or copy the image again");
  const test::SceneFolder folder;
  folder.write("empty.png", std::string());
  CHECK_THROWS_AS(image_size(folder.path() / "empty.png"), Error);
  CHECK_THROWS_AS(image_size(folder.path() / "missing.png"), Error);
  CHECK_THROWS_AS(read_image(folder.path() / "missing.png"), Error);
  CHECK_THROWS_AS(read_image(folder.path()), Error);
  write_png(folder.path() / "a.png", noise(9, 7, false));
  std::string png = read_file(folder.path() / "a.png");
  png[16] = png[20] = 0;
  png[18] = 0x40, png[22] = 0x30;
  folder.write("huge.png", png);
  const std::string message = test::message_of([&] { image_size(folder.path() / "huge.png"); });
  CHECK(message.find("huge.png: claims 16393 x 12295 pixels in ") != std::string::npos);
}

TEST_CASE("write_png throws an Error and keeps the old file", "[scene][image]") {
  const test::SceneFolder folder;
  CHECK_THROWS_AS(write_png(folder.path() / "no" / "folder.png", noise(4, 4, true)), Error);
  CHECK_THROWS_AS(write_png(folder.path() / "empty.png", Image{}), Error);
  CHECK_THROWS_AS(write_png(folder.path() / "short.png", Image{2, 2, {1, 2, 3}}), Error);

  const auto path = folder.path() / "a.png";
  write_png(path, test::plain(2, 2, 9, 9, 9));
  // A limit on the file size simulates a full disk.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = test::message_of([&] { write_png(path, noise(64, 64, true)); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK(message.find("a.png: ") != std::string::npos);
  CHECK(read_image(path).width == 2);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("WebP and TIFF are decoded", "[scene][image][formats]") {
  const test::SceneFolder folder;
  const auto check = [&](const Image& image, const std::string& content, const char* name) {
    CAPTURE(name);
    folder.write(name, content);
    const Image back = read_image(folder.path() / name);
    CHECK(back.width == image.width);
    CHECK(back.height == image.height);
    CHECK(image_size(folder.path() / name).width == image.width);
    CHECK(image_size(folder.path() / name).height == image.height);
    return back;
  };
  const Image opaque = noise(37, 21, true);
  CHECK(check(opaque, webp_of(opaque), "a.webp").rgba == opaque.rgba);
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE})
    for (const int bits : {8, 16}) {
      CAPTURE(compression, bits);
      CHECK(check(opaque, tiff_of(opaque, bits, 3, compression), "a.tif").rgba == opaque.rgba);
    }
  // Returned as stored, like JPEG, with its orientation.
  CHECK(check(opaque, tiff_of(opaque, 8, 3, COMPRESSION_NONE, ORIENTATION_BOTRIGHT), "turned.tif").rgba == opaque.rgba);
  CHECK(image_size(folder.path() / "turned.tif").orientation == 3);
  Image glass = test::plain(8, 6, 200, 100, 40, 128);
  CHECK(check(glass, webp_of(glass), "b.webp").rgba == glass.rgba);
  const Image back = check(glass, tiff_of(glass, 8, 4, COMPRESSION_NONE), "b.tif");
  for (std::size_t i = 0; i < 4; ++i) CHECK(std::abs(back.rgba[i] - glass.rgba[i]) <= 1);
  // A single colour compresses well.
  const Image plain = test::plain(4000, 3000, 255, 255, 255);
  check(plain, webp_of(plain), "plain.webp");
}

TEST_CASE("the errors of oversized images and of unsupported TIFFs name the reason", "[scene][image][formats]") {
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", noise(9, 7, true));
  std::string png = read_file(folder.path() / "a.png");
  png[18] = png[22] = 0x4e, png[19] = png[23] = 0x20;  // 20,000 x 20,000
  folder.write("huge.png", png);
  const std::string expected =
      ": 20000 x 20000 pixels exceed the limit of 268 million (2^28); export the image at a smaller size";
  CHECK(test::message_of([&] { image_size(folder.path() / "huge.png"); }).ends_with("huge.png" + expected));
  CHECK(decode_message(png) == "photo" + expected);
  std::string jpeg = jpeg_of(noise(24, 24, true));
  const std::size_t frame = jpeg.find("\xff\xc0");
  REQUIRE(frame != std::string::npos);
  jpeg[frame + 5] = jpeg[frame + 7] = '\xee';
  folder.write("huge.jpg", jpeg);
  CHECK(test::message_of([&] {
          image_size(folder.path() / "huge.jpg");
        }).find("huge.jpg: 60952 x 60952 pixels exceed the limit of ") != std::string::npos);
  CHECK(decode_message(std::string("II*\0 no directory", 18)).starts_with("photo: the TIFF cannot be read ("));
  CHECK(decode_message("RIFF....WEBPVP8 and no more") == "photo: the WebP header is damaged; export the image again");
}

TEST_CASE("EXIF orientation is applied", "[scene][image][exif]") {
  const test::SceneFolder folder;
  const std::string jpeg = jpeg_of(test::plain(40, 30, 200, 100, 50));
  for (int orientation = 1; orientation <= 8; ++orientation)
    for (const bool little : {false, true}) {
      folder.write("a.jpg", with_orientation(jpeg, orientation, little));
      const ImageSize size = image_size(folder.path() / "a.jpg");
      CHECK(size.width == 40);
      CHECK(size.orientation == orientation);
      CHECK(read_image(folder.path() / "a.jpg").width == 40);
    }
  folder.write("a.jpg", jpeg);
  CHECK(image_size(folder.path() / "a.jpg").orientation == 1);
  folder.write("a.jpg", with_orientation(jpeg, 77, true));
  CHECK(image_size(folder.path() / "a.jpg").orientation == 1);
  for (std::size_t cut = 20; cut < 40; ++cut) {  // a truncated EXIF segment
    std::string bytes = with_orientation(jpeg, 6, false);
    bytes[5] = static_cast<char>(cut - 4);
    folder.write("a.jpg", bytes.erase(cut + 2, 34 - std::min<std::size_t>(34, cut + 2)));
    test::message_of([&] { image_size(folder.path() / "a.jpg"); });
  }
  // 1 2 3   as stored   4 1   a quarter turn clockwise
  // 4 5 6               5 2
  //                     6 3
  Image numbers{3, 2, {}};
  for (std::uint8_t i = 1; i <= 6; ++i) numbers.rgba.insert(numbers.rgba.end(), {i, 0, 0, 255});
  const auto seen = [&](int orientation) {
    const Image image = turned(numbers, orientation);
    std::string text;
    for (int y = 0; y < image.height; ++y, text += ' ')
      for (int x = 0; x < image.width; ++x)
        text += static_cast<char>('0' + image.rgba[std::size_t(4 * (y * image.width + x))]);
    return text;
  };
  CHECK(seen(1) == "123 456 ");
  CHECK(seen(2) == "321 654 ");
  CHECK(seen(3) == "654 321 ");
  CHECK(seen(4) == "456 123 ");
  CHECK(seen(5) == "14 25 36 ");
  CHECK(seen(6) == "41 52 63 ");
  CHECK(seen(7) == "63 52 41 ");
  CHECK(seen(8) == "36 25 14 ");
}

TEST_CASE("the focal length is read from EXIF", "[scene][image][exif]") {
  // MM, one directory with the position of the details, and these with FocalLength at byte 44.
  const auto exif = [](std::uint32_t numerator, std::uint32_t denominator) {
    std::string bytes("MM\0*\0\0\0\x08\0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1a\0\0\0\0", 26);
    bytes += std::string("\0\x01\x92\x0a\0\x05\0\0\0\x01\0\0\0\x2c\0\0\0\0", 18);
    for (const std::uint32_t value : {numerator, denominator})
      for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  const auto focal = [](const std::string& bytes) {
    return read_exif({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}).focal_length;
  };
  CHECK(focal(exif(428, 100)) == Approx(4.28));
  CHECK(focal(exif(428, 0)) == 0);
  for (std::size_t bytes = 0; bytes < 52; ++bytes) CHECK(focal(exif(428, 100).substr(0, bytes)) == 0);
}

TEST_CASE("a JPEG is decoded at reduced size", "[scene][image][reduced]") {
  Image image{203, 101, {}};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.rgba.insert(image.rgba.end(), {std::uint8_t(x), std::uint8_t(2 * y), std::uint8_t(x / 2 + y), 255});
  const std::string jpeg = jpeg_of(image);
  CHECK(decode_image(bytes_of(jpeg), "photo", {.divisor = 1}).rgba == decode_image(bytes_of(jpeg), "photo").rgba);
  for (const int divisor : {2, 4, 8}) {
    CAPTURE(divisor);
    const Image reduced = decode_image(bytes_of(jpeg), "photo", {.divisor = divisor});
    REQUIRE(reduced.width == (203 + divisor - 1) / divisor);
    REQUIRE(reduced.height == (101 + divisor - 1) / divisor);
    int worst = 0;
    for (int y = 0; y < 101 / divisor; ++y)
      for (int x = 0; x < 203 / divisor; ++x)
        for (int c = 0; c < 3; ++c) {
          int sum = 0;
          for (int i = 0; i < divisor * divisor; ++i)
            sum += image.rgba[std::size_t(4 * ((y * divisor + i / divisor) * 203 + x * divisor + i % divisor) + c)];
          worst = std::max(
              worst, std::abs(reduced.rgba[std::size_t(4 * (y * reduced.width + x) + c)] - sum / divisor / divisor));
        }
    CHECK(worst <= 6);  // compression artefacts
    CHECK(reduced.rgba[3] == 255);
  }
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", image);
  CHECK(read_image(folder.path() / "a.png", {.divisor = 4}).width == 203);
  std::string damaged = jpeg;
  const std::size_t quantisation = damaged.find("\xff\xdb");
  damaged[quantisation + 1] = '\xfe';  // turns the segment into a comment
  CHECK(test::message_of([&] {
          decode_image(bytes_of(damaged), "photo", {.divisor = 4});
        }).starts_with("photo: cannot be decoded ("));
}
