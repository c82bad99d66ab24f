// Tests engine/scene/datasets/mask_files.cpp and mask_image.cpp on small generated datasets.
#include <catch2/catch.hpp>

#include "jpeg_of.h"
#include "scene/datasets/mask_image.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using test::plain;
using test::SceneFolder;

namespace {

constexpr int kMaskedWidth = 16, kMaskedHeight = 12;

/// White with a black left half.
Image half_mask(int width = kMaskedWidth, int height = kMaskedHeight) {
  Image image = plain(width, height, 255, 255, 255);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width / 2; ++x)
      for (int c = 0; c < 3; ++c) image.rgba[std::size_t(4 * (y * width + x) + c)] = 0;
  return image;
}

std::string pose_at(int i) { return fmt::format("[[1,0,0,{}],[0,1,0,0],[0,0,1,{}],[0,0,0,1]]", i, 4 + 0.3 * i * i); }

/// A dataset of these photographs, without masks.
void write_photographs(const SceneFolder& folder, const std::vector<std::string>& names, const std::string& own = "") {
  std::string frames;
  for (std::size_t i = 0; i < names.size(); ++i) {
    folder.write(names[i], plain(kMaskedWidth, kMaskedHeight, 100, 100, 100));
    frames += fmt::format("{}{{\"file_path\": \"{}\", \"transform_matrix\": {}{}}}", i ? "," : "", names[i],
                          pose_at(int(i)), own.empty() ? "" : fmt::format(fmt::runtime(own), i));
  }
  folder.write("transforms.json", fmt::format("{{\"fl_x\": 20, \"w\": {}, \"h\": {}, \"frames\": [{}]}}", kMaskedWidth,
                                              kMaskedHeight, frames));
}

struct Result {
  std::string masked;  // for each view in name order: 'l' left half excluded, 'r' right half, '-' none, '?' other
  std::vector<std::string> warnings;
};

Result result_of(const std::filesystem::path& path, LoadOptions options = {}) {
  Result result;
  options.test_every = 0;
  options.warn = [&](const std::string& line) { result.warnings.push_back(line); };
  for (const View& view : load(path, options).train) {
    const auto& rgba = view.image.rgba;
    const bool left = rgba[3] == 0, right = rgba[std::size_t(4 * (view.image.width - 1) + 3)] == 0;
    result.masked += left && !right ? 'l' : right && !left ? 'r' : left ? '?' : '-';
  }
  return result;
}

std::string error_of(const std::filesystem::path& path) {
  return test::message_of([&] { result_of(path); });
}

}  // namespace

TEST_CASE("masks are found under the names and in the folders that programs use", "[scene][masks]") {
  const char* const mask =
      GENERATE("masks/a.png", "masks/A.PNG", "mask/a.png", "Masks/a.png", "masks_4/a.png", "masks/a.jpg.png",
               "masks/a.mask.png", "masks/a_mask.png", "masks/mask_a.png", "masks/dynamic_mask_a.png", "masks/a.mask",
               "masks/a-mask.png", "masks/a.jpg.mask.png", "masks/images/a.png", "images/masks/a.png",
               "images/a_mask.png", "images/a.mask.png", "segmentation/a.png", "masks/sub/a.png");
  CAPTURE(mask);
  const SceneFolder folder;
  write_photographs(folder, {"images/a.jpg"});
  CHECK(result_of(folder.path()).masked == "-");
  folder.write(mask, half_mask());
  CHECK(result_of(folder.path()).masked == "l");
  LoadOptions inverted;
  inverted.invert_masks = true;
  CHECK(result_of(folder.path(), inverted).masked == "r");
}

TEST_CASE("train_masks decodes training photographs only if they may have masks", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/a.png", "images/b.png", "images/c.png"});
  LoadOptions options;
  options.test_every = 2;  // a and c
  options.train_images = false;
  options.train_masks = true;
  CHECK(load(folder.path(), options).train[0].image.rgba.empty());
  options.alpha = AlphaUse::mask;
  CHECK_FALSE(load(folder.path(), options).train[0].image.rgba.empty());
  options.alpha = AlphaUse::composite;
  for (const char* name : {"masks/a.png", "masks/b.png", "masks/c.png"}) folder.write(name, half_mask());
  const Scene scene = load(folder.path(), options);
  REQUIRE(scene.train.size() == 1);
  REQUIRE_FALSE(scene.train[0].image.rgba.empty());
  CHECK(scene.train[0].image.rgba[3] == 0);
  options.train_masks = false;
  CHECK(load(folder.path(), options).train[0].image.rgba.empty());
}

TEST_CASE("dynamic masks beside the photographs are read as instant-ngp reads them", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/a.png", "images/b.png"});
  for (const char* name : {"images/dynamic_mask_a.png", "images/dynamic_mask_b.png"}) folder.write(name, half_mask());
  const Result result = result_of(folder.path());
  CHECK(result.masked == "rr");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("`invert_masks`") != std::string::npos);
}

TEST_CASE("masks in subfolders belong to the photographs in the same subfolders", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/back/0.png", "images/front/0.png"});
  folder.write("masks/front/0.png", half_mask());
  Result result = result_of(folder.path());
  CHECK(result.masked == "-l");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("masks for 1 of 2 photographs, none for images/back/0.png; ") != std::string::npos);
  // A flat mask may be of either photograph.
  std::filesystem::remove_all(folder.path() / "masks");
  folder.write("masks/0.png", half_mask());
  result = result_of(folder.path());
  CHECK(result.masked == "--");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("masks: none of its masks is used, because photographs in several folders") !=
        std::string::npos);
  // With names of their own, flat masks are unmistakable.
  const SceneFolder own;
  write_photographs(own, {"images/back/0.png", "images/front/1.png"});
  own.write("masks/0.png", half_mask());
  own.write("masks/1.png", half_mask());
  CHECK(result_of(own.path()).masked == "ll");
}

TEST_CASE("masks that belong to no photograph are an error", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/a.png"});
  folder.write("masks/z.png", half_mask());
  CHECK(
      error_of(folder.path()).find("masks: holds z.png, but no mask of any of the 1 photographs; looked for a.png, ") !=
      std::string::npos);
  std::filesystem::remove(folder.path() / "masks/z.png");
  folder.write("masks/a.npy", std::string("x"));
  CHECK(error_of(folder.path()).find("masks: holds a.npy, but ") != std::string::npos);
  std::filesystem::remove(folder.path() / "masks/a.npy");
  folder.write("masks/note.txt", std::string("x"));
  CHECK(result_of(folder.path()).warnings.empty());
  folder.write("sky_masks/a.png", half_mask());
  const Result result = result_of(folder.path());
  CHECK(result.masked == "-");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("sky_masks: not used as masks; ") != std::string::npos);
  // Labels of classes are no masks.
  folder.write("segmentation/a.png", plain(kMaskedWidth, kMaskedHeight, 7, 7, 7));
  CHECK(result_of(folder.path()).warnings.size() == 2);
}

TEST_CASE("masks that are missing are said in one line", "[scene][masks]") {
  const SceneFolder folder;
  const std::vector<std::string> names{"images/0.png", "images/1.png", "images/2.png"};
  write_photographs(folder, names);
  folder.write("masks/0.png", half_mask());
  folder.write("masks/2.png", half_mask());
  Result result = result_of(folder.path());
  CHECK(result.masked == "l-l");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("masks for 2 of 3 photographs, none for images/1.png; ") != std::string::npos);
  // The same with mask_path.
  write_photographs(folder, names, ", \"mask_path\": \"masks/{}.png\"");
  result = result_of(folder.path());
  CHECK(result.masked == "l-l");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("transforms.json: left out 1 mask: mask_path does not exist") != std::string::npos);
  CHECK(result.warnings[0].ends_with(": masks/1.png"));
  write_photographs(folder, names, ", \"mask_path\": \"C:\\\\m\\\\Masks\\\\{}.PNG\"");
  CHECK(result_of(folder.path()).masked == "l-l");
  write_photographs(folder, names, ", \"mask_path\": \"nowhere/x{}.png\"");
  CHECK(error_of(folder.path()).find("transforms.json: mask_path nowhere/x0.png does not exist; ") !=
        std::string::npos);
}

TEST_CASE("a mask of other proportions is left out, and most of them are an error", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/0.png", "images/1.png", "images/2.png"});
  folder.write("masks/0.png", half_mask(kMaskedWidth / 2, kMaskedHeight / 2));  // the same proportions
  folder.write("masks/1.png", half_mask(kMaskedHeight, kMaskedWidth));
  folder.write("masks/2.png", half_mask());
  Result result = result_of(folder.path());
  CHECK(result.masked == "l-l");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("transforms.json: left out 1 mask: has other proportions than its photograph; ") !=
        std::string::npos);
  folder.write("masks/1.png", std::string("no picture"));
  result = result_of(folder.path());
  CHECK(result.masked == "l-l");
  CHECK(result.warnings.size() == 1);
  folder.write("masks/1.png", half_mask(kMaskedHeight, kMaskedWidth));
  folder.write("masks/2.png", half_mask(kMaskedHeight, kMaskedWidth));
  CHECK(error_of(folder.path())
            .find("1.png: mask (12 x 16 beside 16 x 12) has other proportions than its photograph; ") !=
        std::string::npos);
}

TEST_CASE("a mask whose end is missing is left out", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/0.png", "images/1.png", "images/2.png"});
  for (int i = 0; i < 3; ++i) folder.write(fmt::format("masks/{}.png", i), half_mask());
  const auto cut = folder.path() / "masks/1.png";
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) - 20);
  const Result result = result_of(folder.path());
  CHECK(result.masked == "l-l");
  REQUIRE(result.warnings.size() == 1);
  CHECK(result.warnings[0].find("1.png: cut off") != std::string::npos);
  CHECK(result.warnings[0].find("1 of 3 masks") != std::string::npos);
}

TEST_CASE("a mask is turned as its photograph is", "[scene][masks][exif]") {
  const SceneFolder folder;
  // Stored 12 wide and 16 high. Turned clockwise, the bottom is on the left.
  Image stored = plain(kMaskedHeight, kMaskedWidth, 255, 255, 255);
  for (int y = kMaskedWidth / 2; y < kMaskedWidth; ++y)
    for (int x = 0; x < kMaskedHeight; ++x)
      for (int c = 0; c < 3; ++c) stored.rgba[std::size_t(4 * (y * kMaskedHeight + x) + c)] = 0;
  write_photographs(folder, {"images/a.jpg"});
  folder.write("images/a.jpg",
               test::with_orientation(test::jpeg_of(plain(kMaskedHeight, kMaskedWidth, 90, 90, 90)), 6));
  folder.write("masks/a.png", stored);
  CHECK(result_of(folder.path()).masked == "l");
  folder.write("masks/a.png", half_mask());  // upright already
  CHECK(result_of(folder.path()).masked == "l");
  // Used as stored, with a mask that is upright: turned back.
  folder.write("images/a.jpg",
               test::with_orientation(test::jpeg_of(plain(kMaskedWidth, kMaskedHeight, 90, 90, 90)), 6));
  Image upright = plain(kMaskedHeight, kMaskedWidth, 255, 255, 255);  // the left of the stored picture is on top
  for (int y = 0; y < kMaskedWidth / 2; ++y)
    for (int x = 0; x < kMaskedHeight; ++x)
      for (int c = 0; c < 3; ++c) upright.rgba[std::size_t(4 * (y * kMaskedHeight + x) + c)] = 0;
  folder.write("masks/a.png", upright);
  CHECK(result_of(folder.path()).masked == "l");
}

TEST_CASE("masks in alpha", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/a.png"});
  for (const int grey : {0, 255}) {
    const auto value = static_cast<std::uint8_t>(grey);
    Image mask = plain(kMaskedWidth, kMaskedHeight, value, value, value);
    for (int y = 0; y < kMaskedHeight; ++y)
      for (int x = 0; x < kMaskedWidth / 2; ++x) mask.rgba[std::size_t(4 * (y * kMaskedWidth + x) + 3)] = 0;
    folder.write("masks/a.png", mask);
    CHECK(result_of(folder.path()).masked == "l");
  }
  // Colour decides where it differs, whatever alpha is.
  Image mask = half_mask();
  mask.rgba[std::size_t(4 * (kMaskedWidth - 1) + 3)] = 0;
  folder.write("masks/a.png", mask);
  CHECK(result_of(folder.path()).masked == "l");
}

TEST_CASE("masks that leave nothing are said to look inverted", "[scene][masks]") {
  const SceneFolder folder;
  write_photographs(folder, {"images/a.png"});
  folder.write("masks/a.png", plain(kMaskedWidth, kMaskedHeight, 0, 0, 0));
  CHECK(error_of(folder.path()).find("if the masks are inverted, use `invert_masks`") != std::string::npos);
  LoadOptions inverted;
  inverted.invert_masks = true;
  CHECK(result_of(folder.path(), inverted).masked == "-");
}
