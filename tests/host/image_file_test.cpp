// Tests engine/scene/image_file.h: what is written comes back, and damage is noticed.
#include <catch2/catch.hpp>

#include <sys/resource.h>

#include <csignal>
#include <random>

#include "error.h"
#include "image/image_file.h"
#include "read_file.h"
#include "scene_temporary_folder.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

using namespace trisoup;

namespace {

Image noise(int width, int height, bool opaque) {
  std::mt19937 random(3);
  Image image{width, height, {}};
  for (int i = 0; i < width * height * 4; ++i)
    image.rgba.push_back(opaque && i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random()));
  return image;
}

std::string jpeg_of(const Image& image) {
  std::string content;
  stbi_write_jpg_to_func(
      [](void* to, void* data, int size) { static_cast<std::string*>(to)->append(static_cast<char*>(data), std::size_t(size)); },
      &content, image.width, image.height, 4, image.rgba.data(), 90);
  return content;
}

std::string decode_message(const std::string& content) {
  return test::message_of([&] { decode_image(bytes_of(content), "photo"); });
}

}  // namespace

TEST_CASE("a PNG comes back as it was written", "[scene][image]") {
  const test::SceneFolder folder;
  const bool opaque = GENERATE(true, false);
  const Image image = noise(37, 21, opaque);
  const auto path = folder.path() / "a.png";
  write_png(path, test::plain(5, 5, 1, 2, 3));  // to be replaced
  write_png(path, image);
  const Image back = read_image(path);
  CHECK(back.width == 37);
  CHECK(back.height == 21);
  CHECK(back.rgba == image.rgba);
  CHECK(image_size(path).width == 37);
  CHECK(image_size(path).height == 21);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);  // no temporary file left
}

TEST_CASE("a JPEG is decoded, its EXIF thumbnail and its trailing bytes do no harm", "[scene][image]") {
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
  CHECK(decode_message(with_thumbnail.substr(0, with_thumbnail.size() - 30)).starts_with("photo: is cut before its end; "));
}

TEST_CASE("an image cut anywhere is an Error of one line", "[scene][image]") {
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", noise(9, 7, false));
  const std::string png = read_file(folder.path() / "a.png"), jpeg = jpeg_of(noise(24, 24, true));
  for (const std::string& whole : {png, jpeg}) {
    REQUIRE(decode_message(whole).empty());
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const std::string message = decode_message(whole.substr(0, size));
      INFO(size << " of " << whole.size());
      CHECK(message.starts_with("photo: "));
      CHECK(message.find('\n') == std::string::npos);
    }
  }
}

TEST_CASE("a JPEG whose Huffman table overflows is refused", "[scene][image]") {
  std::string jpeg = jpeg_of(noise(24, 24, true));
  const std::size_t table = jpeg.find("\xff\xc4");
  REQUIRE(table != std::string::npos);
  jpeg[table + 5] = jpeg[table + 6] = '\xff';  // 510 codes where 256 are possible
  CHECK(decode_message(jpeg) == "photo: has an impossible Huffman table; copy or export the image again");
}

TEST_CASE("a changed PNG is noticed by its checksum", "[scene][image]") {
  const test::SceneFolder folder;
  write_png(folder.path() / "a.png", noise(9, 7, false));
  std::string png = read_file(folder.path() / "a.png");
  png[60] = static_cast<char>(png[60] ^ 1);
  CHECK(decode_message(png) == "photo: has a wrong checksum; copy or export the image again");
}

TEST_CASE("other formats and impossible sizes are Errors", "[scene][image]") {
  CHECK(decode_message("") == "photo: neither PNG nor JPEG; convert the image to one of them");
  CHECK(decode_message("BM not an image") == "photo: neither PNG nor JPEG; convert the image to one of them");
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

TEST_CASE("write_png fails with an Error and leaves the old file", "[scene][image]") {
  const test::SceneFolder folder;
  CHECK_THROWS_AS(write_png(folder.path() / "no" / "folder.png", noise(4, 4, true)), Error);
  CHECK_THROWS_AS(write_png(folder.path() / "empty.png", Image{}), Error);
  CHECK_THROWS_AS(write_png(folder.path() / "short.png", Image{2, 2, {1, 2, 3}}), Error);

  const auto path = folder.path() / "a.png";
  write_png(path, test::plain(2, 2, 9, 9, 9));
  // A limit on the file size stands in for a disk that is full.
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
