// Tests engine/scene/load/load.cpp, dataset*.cpp and photograph_files.cpp on small generated datasets.
#include <catch2/catch.hpp>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>

#include <jpeglib.h>

#include "base/error.h"
#include "image/image_file.h"
#include "jpeg_of.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using test::plain;
using test::SceneFolder;

namespace {

// Row-major OpenGL camera-to-world matrix of a camera on a circle around the z axis that looks at the origin.
std::string blender_pose(int i, double radius = 4) {
  const double a = 0.6 * i, c = std::cos(a), s = std::sin(a);
  return fmt::format("[[{},0,{},{}],[{},0,{},{}],[0,1,0,0],[0,0,0,1]]", -s, c, radius * c, c, s, radius * s);
}

std::string frame(const std::string& path, int i, const std::string& own = "") {
  return fmt::format("{{\"file_path\": \"{}\", \"transform_matrix\": {}{}}}", path, blender_pose(i), own);
}

std::string file_of(const std::string& shared, const std::vector<std::string>& frames) {
  std::string text = "{" + shared + "\"frames\": [";
  for (std::size_t i = 0; i < frames.size(); ++i) text += (i ? ",\n" : "") + frames[i];
  return text + "]}";
}

// transforms.json with `count` images of 16 x 12 pixels and increasing brightness.
void write_transforms(const SceneFolder& folder, int count, const std::string& shared = "") {
  std::vector<std::string> frames;
  for (int i = 0; i < count; ++i) {
    const std::string name = fmt::format("images/{:02}.png", i);
    frames.push_back(frame(name, i));
    folder.write(name, plain(16, 12, std::uint8_t(10 * i), 0, 0));
  }
  folder.write("transforms.json", file_of("\"fl_x\": 20, \"w\": 16, \"h\": 12," + shared, frames));
}

// A COLMAP text model with two images in a subfolder.
void write_colmap(const SceneFolder& folder, const std::string& model, const std::string& camera) {
  folder.write(model + "cameras.txt", camera + "\n");
  folder.write(model + "images.txt", "1 1 0 0 0 0 0 4 1 sub/b.png\n\n2 0.8 0.6 0 0 0 0 4 1 sub/a.png\n\n");
  folder.write(model + "points3D.txt", "1 0 0 1 255 0 0 0.1 1 0\n");
}

std::string message(const std::filesystem::path& path, const LoadOptions& options = {}) {
  return test::message_of([&] { load(path, options); });
}

std::vector<std::string> names(const std::vector<View>& views) {
  std::vector<std::string> result;
  for (const View& view : views) result.push_back(view.name);
  return result;
}

std::vector<int> pixel(const View& view, int index = 0) {
  const auto start = view.image.rgba.begin() + 4 * index;
  return {start, start + 4};
}

}  // namespace

TEST_CASE("Blender: file extension added, given test split, white background", "[scene][load]") {
  const SceneFolder folder;
  for (int i : {0, 1, 2, 10})
    folder.write(fmt::format("train/r_{}.png", i), plain(8, 8, 0, 255, 0, std::uint8_t(i == 2 ? 127 : 254)));
  folder.write("test/r_0.png", plain(8, 8, 10, 20, 30));
  folder.write("transforms_train.json",
               file_of("\"camera_angle_x\": 0.7,", {frame("./train/r_2", 2), frame("./train/r_10", 3),
                                                    frame("./train/r_0", 0), frame("./train/r_1", 1)}));
  folder.write("transforms_val.json", file_of("\"camera_angle_x\": 0.7,", {frame("./train/r_1", 1)}));
  folder.write("transforms_test.json", file_of("\"camera_angle_x\": 0.7,", {frame("./test/r_0", 4)}));
  for (const auto& path :
       {folder.path(), folder.path() / "transforms_train.json", folder.path() / "transforms_test.json"}) {
    const Scene scene = load(path, {});
    CHECK(scene.format == Format::blender);
    CHECK(scene.synthetic);
    CHECK(names(scene.train) ==
          std::vector<std::string>{"train/r_0.png", "train/r_1.png", "train/r_10.png", "train/r_2.png"});
    CHECK(names(scene.test) == std::vector<std::string>{"test/r_0.png"});
    CHECK(scene.background == glm::vec3(1.0f));
    CHECK(pixel(scene.train[3]) == std::vector<int>{128, 255, 128, 191});
    CHECK(pixel(scene.train[0]) == std::vector<int>{1, 255, 1, 255});
    CHECK(scene.train[0].camera.fx == Approx(4 / std::tan(0.35)));
    CHECK(scene.points.positions.empty());
    // The circle has radius 4 and is centred at the origin.
    CHECK(scene.normalisation.scale == Approx(0.25));
    CHECK(glm::distance(scene.train[0].camera.centre(), glm::dvec3(1, 0, 0)) < 1e-9);
    CHECK(glm::distance(scene.train[0].camera.forward(), glm::dvec3(-1, 0, 0)) < 1e-9);
  }
  LoadOptions black;
  black.background = BackgroundChoice::black;
  CHECK(pixel(load(folder.path(), black).train[3]) == std::vector<int>{0, 127, 0, 191});
  LoadOptions mask;
  mask.alpha = AlphaUse::mask;
  CHECK(pixel(load(folder.path(), mask).train[3]) == std::vector<int>{0, 255, 0, 0});
  CHECK(pixel(load(folder.path(), mask).train[0]) == std::vector<int>{0, 255, 0, 255});

  std::filesystem::remove(folder.path() / "transforms_test.json");
  CHECK(names(load(folder.path(), {}).test) == std::vector<std::string>{"train/r_1.png"});  // the validation split
  std::filesystem::remove(folder.path() / "transforms_val.json");
  CHECK(names(load(folder.path(), {}).test) == std::vector<std::string>{"train/r_0.png"});  // every 8th
}

TEST_CASE("transforms.json: every n-th view in name order is held out, starting with index 0", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 7);
  LoadOptions options;
  options.test_every = 3;
  const Scene scene = load(folder.path(), options);
  CHECK(scene.format == Format::transforms);
  CHECK_FALSE(scene.synthetic);
  CHECK(names(scene.test) == std::vector<std::string>{"images/00.png", "images/03.png", "images/06.png"});
  CHECK(scene.train.size() == 4);
  CHECK(scene.background == glm::vec3(0.0f));
  CHECK(pixel(scene.test[1]) == std::vector<int>{30, 0, 0, 255});
  options.test_every = 0;
  CHECK(load(folder.path(), options).test.empty());
  CHECK(load(folder.path() / "transforms.json", options).train.size() == 7);
}

TEST_CASE("nerfstudio: split by file names, masks and points", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 4,
                   "\"ply_file_path\": \"p.ply\", \"train_filenames\": [\"images/00.png\", \"images/03.png\"], "
                   "\"test_filenames\": [\"./images/02.png\"],");
  folder.write("p.ply",
               "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
               "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n0 0 2 1 2 3\n");
  folder.write("masks/00.png", plain(16, 12, 0, 0, 0));
  folder.write("masks/02.png.png", plain(8, 6, 1, 1, 1));
  const Scene scene = load(folder.path(), {});
  CHECK(names(scene.train) == std::vector<std::string>{"images/00.png", "images/03.png"});
  CHECK(names(scene.test) == std::vector<std::string>{"images/02.png"});
  CHECK(pixel(scene.train[0])[3] == 0);
  CHECK(pixel(scene.train[1])[3] == 255);
  CHECK(pixel(scene.test[0])[3] == 255);
  REQUIRE(scene.points.positions.size() == 1);
  CHECK(glm::distance(glm::dvec3(scene.points.positions[0]), scene.normalisation.to_normalised({0, 0, 2})) < 1e-6);
  CHECK(scene.points.colours.at(0) == glm::u8vec3(1, 2, 3));

  const SceneFolder own;
  own.write("a.jpg.png", plain(16, 12, 9, 9, 9));
  Image mask = plain(16, 12, 255, 255, 255);
  mask.rgba[0] = mask.rgba[1] = mask.rgba[2] = 0;
  own.write("m.png", mask);
  own.write("transforms.json", file_of("\"fl_x\": 20,", {frame("a.jpg.png", 0, ", \"mask_path\": \"m.png\"")}));
  CHECK(pixel(load(own.path(), {}).train.at(0))[3] == 0);
  std::filesystem::remove(own.path() / "m.png");
  CHECK(message(own.path()).find("transforms.json: mask_path m.png does not exist; ") != std::string::npos);
}

TEST_CASE("missing images are skipped with one warning", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 6);
  std::filesystem::remove(folder.path() / "images/01.png");
  std::filesystem::remove(folder.path() / "images/04.png");
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  const Scene scene = load(folder.path(), options);
  CHECK(scene.train.size() + scene.test.size() == 4);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find(
            "transforms.json: skipped 2 of 6 frames whose image is missing, first: images/01.png (looked for ") !=
        std::string::npos);
  CHECK(lines[0].ends_with((folder.path() / "images/01.png").string() + ")"));
  std::filesystem::remove_all(folder.path() / "images");
  CHECK(message(folder.path()).find("none of its 6 images was found, first: images/00.png; ") != std::string::npos);
}

TEST_CASE("COLMAP: subfolders, all locations of the model and the images", "[scene][load]") {
  const std::string model = GENERATE("sparse/0/", "sparse/", "");
  const std::string images = GENERATE("images/", "");
  const SceneFolder folder;
  write_colmap(folder, model, "1 PINHOLE 32 24 40 41 16 12");
  folder.write(images + "sub/a.png", plain(32, 24, 1, 0, 0));
  folder.write(images + "sub/b.png", plain(32, 24, 2, 0, 0));
  LoadOptions options;
  options.test_every = 2;
  const Scene scene = load(folder.path(), options);
  CHECK(scene.format == Format::colmap);
  CHECK(names(scene.test) == std::vector<std::string>{images + "sub/a.png"});
  CHECK(names(scene.train) == std::vector<std::string>{images + "sub/b.png"});
  CHECK(pixel(scene.train[0]) == std::vector<int>{2, 0, 0, 255});
  CHECK(scene.points.positions.size() == 1);
  // The training camera is at (0, 0, -4) and its only point 5 units ahead.
  CHECK(scene.normalisation.scale == Approx(0.2));
}

TEST_CASE("the resolution option resamples, or uses the prescaled folder if there is one", "[scene][load]") {
  const SceneFolder folder;
  write_colmap(folder, "sparse/0/", "1 PINHOLE 33 24 40 41 16.5 12");
  for (const char* name : {"images/sub/a.png", "images/sub/b.png"}) folder.write(name, plain(33, 24, 100, 0, 0));
  LoadOptions options;
  options.test_every = 0;
  options.downscale = 2;
  Scene scene = load(folder.path(), options);
  const Camera& camera = scene.train[0].camera;
  CHECK(camera.width == 17);  // 16.5 rounds up
  CHECK(camera.height == 12);
  CHECK(scene.train[0].image.width == 17);
  CHECK(camera.fx == Approx(40 * 17 / 33.0));
  CHECK(camera.cx == Approx(8.5));
  CHECK(camera.fy == Approx(20.5));
  CHECK(pixel(scene.train[0]) == std::vector<int>{100, 0, 0, 255});
  const auto fingerprint = scene.fingerprint;

  folder.write("images_2/sub/b.png", plain(16, 12, 50, 0, 0));
  scene = load(folder.path(), options);
  CHECK(names(scene.train) == std::vector<std::string>{"images/sub/a.png", "images/sub/b.png"});
  CHECK(scene.train[0].image.width == 17);  // missing in the prescaled folder
  CHECK(scene.train[1].image.width == 16);
  CHECK(scene.train[1].camera.fx == Approx(40 * 16 / 33.0));
  CHECK(pixel(scene.train[1]) == std::vector<int>{50, 0, 0, 255});
  CHECK(scene.fingerprint != fingerprint);
  options.downscale = 1.5;
  CHECK(load(folder.path(), options).train[1].image.width == 22);
  options.downscale = 1000;
  CHECK(load(folder.path(), options).train[1].image.width == 1);

  // Only the prescaled images were downloaded.
  options.downscale = 2;
  folder.write("images_2/sub/a.JPG", plain(16, 12, 50, 0, 0));
  std::filesystem::remove_all(folder.path() / "images");
  CHECK(load(folder.path(), options).train.size() == 2);
}

TEST_CASE("distorted images are undistorted, with pixels outside of the photograph masked", "[scene][load]") {
  const SceneFolder folder;
  write_colmap(folder, "sparse/0/", "1 SIMPLE_RADIAL 32 24 30 16 12 0.3");
  folder.write("images/sub/a.png", plain(32, 24, 100, 0, 0));
  folder.write("images/sub/b.png", plain(32, 24, 100, 0, 0));
  LoadOptions options;
  options.test_every = 0;
  const View view = load(folder.path(), options).train[0];
  CHECK(pixel(view)[3] == 0);
  CHECK(pixel(view, 12 * 32 + 16) == std::vector<int>{100, 0, 0, 255});
}

TEST_CASE("images of several sizes in one scene", "[scene][load]") {
  const SceneFolder folder;
  folder.write("a.png", plain(10, 20, 1, 1, 1));
  folder.write("b.png", plain(40, 8, 1, 1, 1));
  folder.write("c.png", plain(10, 10, 1, 1, 1));
  folder.write("transforms.json", file_of("\"camera_angle_x\": 1.0,", {frame("a", 0), frame("b", 1), frame("c", 2)}));
  LoadOptions options;
  options.test_every = 0;
  const Scene scene = load(folder.path(), options);
  REQUIRE(scene.train.size() == 3);
  CHECK(scene.train[0].image.height == 20);
  CHECK(scene.train[1].camera.cx == 20);
  CHECK(scene.train[1].image.rgba.size() == 40 * 8 * 4);
}

TEST_CASE("train_images = false does not change cameras and fingerprint", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 9);
  std::atomic<int> calls = 0;
  int last = 0;
  LoadOptions options;
  options.progress = [&](int done, int total) {
    ++calls;
    CHECK(done == last + 1);
    last = done;
    CHECK(total == 9);
  };
  options.threads = 3;
  const Scene whole = load(folder.path(), options);
  CHECK(calls == 9);
  options.train_images = false;
  options.progress = nullptr;
  const Scene tests = load(folder.path(), options);
  CHECK(tests.fingerprint == whole.fingerprint);
  CHECK(tests.test[0].image.rgba == whole.test[0].image.rgba);
  REQUIRE(tests.train.size() == whole.train.size());
  CHECK(tests.train[2].image.rgba.empty());
  CHECK(tests.train[2].camera.width == 16);
  CHECK(tests.train[2].camera.world_to_camera == whole.train[2].camera.world_to_camera);
}

TEST_CASE("the fingerprint distinguishes scenes", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 5);
  LoadOptions options;
  const auto first = load(folder.path(), options).fingerprint;
  options.threads = 1;
  options.background = BackgroundChoice::white;
  CHECK(load(folder.path(), options).fingerprint == first);
  options.downscale = 2;
  CHECK(load(folder.path(), options).fingerprint != first);
  options.downscale = 1;
  options.test_every = 3;
  CHECK(load(folder.path(), options).fingerprint != first);
  write_transforms(folder, 5, "\"cx\": 8.1,");
  CHECK(load(folder.path(), {}).fingerprint != first);
}

TEST_CASE("the fingerprint of photographs depends on the options that change them", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 3);
  LoadOptions options;
  options.background = BackgroundChoice::black;
  const auto first = fingerprint_of_photographs(load(folder.path(), options).train);
  CHECK(fingerprint_of_photographs(load(folder.path(), options).train) == first);
  Scene scene = load(folder.path(), options);
  for (const std::size_t at : {std::size_t{0}, std::size_t{7}, scene.train.back().image.rgba.size() - 1}) {
    CAPTURE(at);
    const std::uint8_t bit = at % 4 == 3 ? 128 : 1;  // of alpha, the mask
    scene.train.back().image.rgba[at] ^= bit;
    CHECK(fingerprint_of_photographs(scene.train) != first);
    scene.train.back().image.rgba[at] ^= bit;
  }
  std::swap(scene.train.front().image, scene.train.back().image);
  REQUIRE(scene.train.front().image.rgba != scene.train.back().image.rgba);
  CHECK(fingerprint_of_photographs(scene.train) != first);
}

TEST_CASE("a single view is used for training", "[scene][load]") {
  const SceneFolder folder;
  write_transforms(folder, 1);
  const Scene scene = load(folder.path(), {});
  CHECK(scene.train.size() == 1);
  CHECK(scene.test.empty());
  CHECK(glm::length(scene.train[0].camera.centre()) == Approx(1.0));
}

TEST_CASE("errors are one line", "[scene][load]") {
  const SceneFolder folder;
  CHECK(message(folder.path() / "nowhere").find("nowhere: no such file or folder; ") != std::string::npos);
  CHECK(message(folder.path()).find("contains neither transforms_train.json nor ") != std::string::npos);
  folder.write("notes.txt", std::string("x"));
  CHECK(message(folder.path() / "notes.txt").find("notes.txt: not a dataset; ") != std::string::npos);
  folder.write("transforms.json", std::string("{\"frames\": []}"));
  CHECK(message(folder.path()).find("transforms.json: lists no frames; ") != std::string::npos);

  write_transforms(folder, 3);
  LoadOptions options;
  options.downscale = 0.5;
  CHECK(message(folder.path(), options).starts_with("`resolution` 0.5: "));
  options.downscale = std::nan("");
  CHECK(message(folder.path(), options).starts_with("`resolution` nan: "));
  options = {};
  options.test_every = 1;
  CHECK(message(folder.path(), options).starts_with("`test_every` 1: "));

  folder.write("images/01.png", plain(32, 24, 0, 0, 0));  // same aspect ratio
  CHECK(message(folder.path()).empty());

  const std::filesystem::path image = folder.path() / "images/02.png";
  std::filesystem::resize_file(image, std::filesystem::file_size(image) - 9);
  {
    std::vector<std::string> lines;
    LoadOptions cut;
    cut.warn = [&](const std::string& line) { lines.push_back(line); };
    CHECK(names(load(folder.path(), cut).train) == std::vector<std::string>{"images/01.png"});
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].find("left out 1 photograph: cut off ") != std::string::npos);
    CHECK(lines[0].ends_with(": images/02.png"));
  }
  for (const char* name : {"images/00.png", "images/01.png", "images/02.png"})
    folder.write(name, std::string("this is no image at all"));
  CHECK(message(folder.path()).find("00.png: not a picture of a known type, or its header is damaged; ") !=
        std::string::npos);
  write_transforms(folder, 3, "\"ply_file_path\": \"p.ply\",");
  std::vector<std::string> lines;
  options = {};
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  CHECK(load(folder.path(), options).points.positions.empty());
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].ends_with("ply_file_path p.ply does not exist; points are searched for in the photographs"));

  const SceneFolder spot;
  for (const char* name : {"a.png", "b.png"}) spot.write(name, plain(4, 4, 0, 0, 0));
  const std::string here = ", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}";
  spot.write("transforms.json",
             file_of("\"fl_x\": 9,", {"{\"file_path\": \"a.png\"" + here, "{\"file_path\": \"b\"" + here}));
  options = {};
  options.test_every = 0;
  CHECK(message(spot.path(), options).find("transforms.json: all 2 cameras are at one spot; ") != std::string::npos);
}

TEST_CASE("inconsistent COLMAP models are Errors", "[scene][load]") {
  const SceneFolder folder;
  write_colmap(folder, "sparse/0/", "2 PINHOLE 32 24 40 41 16 12");
  CHECK(message(folder.path()).find("images.txt: sub/b.png uses camera 1, which is missing in cameras.txt; ") !=
        std::string::npos);
  folder.write("sparse/0/cameras.txt", std::string("# nothing\n"));
  CHECK(message(folder.path()).find("cameras.txt: contains no camera; ") != std::string::npos);
  folder.write("sparse/0/cameras.txt", std::string("1 PINHOLE 32 24 40 41 16 12\n"));
  CHECK(message(folder.path()).find("none of its 2 images was found, first: ") != std::string::npos);
  folder.write("sparse/0/images.txt", std::string("# nothing\n"));
  CHECK(message(folder.path()).find("images.txt: contains no image; ") != std::string::npos);
  std::filesystem::remove(folder.path() / "sparse/0/cameras.txt");
  CHECK(message(folder.path()).find("cameras.txt: no such file; ") != std::string::npos);
}

TEST_CASE("intrinsics of the full-size photograph with a reduced image are reported", "[scene][load][intrinsics]") {
  const SceneFolder folder;
  const auto with = [&](const std::string& intrinsics) {
    std::vector<std::string> lines;
    LoadOptions options;
    options.warn = [&](const std::string& line) { lines.push_back(line); };
    folder.write("a.png", plain(16, 12, 9, 9, 9));
    folder.write("b.png", plain(16, 12, 9, 9, 9));
    folder.write("transforms.json", file_of(intrinsics, {frame("a.png", 0), frame("b.png", 1)}));
    load(folder.path(), options);
    return lines;
  };
  const auto error = [&](const std::string& intrinsics) { return test::message_of([&] { with(intrinsics); }); };
  // Intrinsics for 64 x 48 pixels.
  const std::string outside = error("\"fl_x\": 80, \"cx\": 32.5, \"cy\": 23.6,");
  CHECK(outside.find(
            "transforms.json: the principal point (32.5, 23.6) of a.png lies outside its image of 16 x 12 pixels; ") !=
        std::string::npos);
  CHECK(outside.find("likely the intrinsics of the photograph at 64 x 48 pixels; state that size") !=
        std::string::npos);
  CHECK(error("\"fl_x\": 20, \"cx\": 8, \"cy\": -1,").ends_with("; correct cx and cy"));
  CHECK(error("\"fl_x\": 20, \"cx\": 16, \"cy\": 12,").find("at 32 x 24 pixels") != std::string::npos);
  // Intrinsics for 24 x 18 and 8 x 6 pixels: inside of the image, but far from its centre.
  for (const auto& [cx, cy, size] : {std::tuple(12.1, 8.9, "24 x 18"), {4.0, 3.1, "8 x 6"}}) {
    const auto lines = with(fmt::format("\"fl_x\": 30, \"cx\": {}, \"cy\": {},", cx, cy));
    REQUIRE(lines.size() == 1);
    CHECK(lines[0].find("far from the centre of its 16 x 12 pixels; ") != std::string::npos);
    CHECK(lines[0].find(size) != std::string::npos);
    CHECK(lines[0].ends_with("(2 of 2 photographs)"));
  }
  // A focal length for a width of 64 pixels contradicts the field of view.
  const auto lines = with("\"fl_x\": 80, \"camera_angle_x\": 0.7610127542247298,");
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("the focal length of a.png, 80 pixels, contradicts camera_angle_x; ") != std::string::npos);
  CHECK(lines[0].find("at 64 x 48 pixels") != std::string::npos);
  // Valid cases: a slightly decentred lens, a crop on one side, intrinsics with their size.
  CHECK(with("\"fl_x\": 20, \"cx\": 8.5, \"cy\": 5.6,").empty());
  CHECK(with("\"fl_x\": 20, \"cx\": 12, \"cy\": 6,").empty());
  CHECK(with("\"fl_x\": 80, \"cx\": 32, \"cy\": 24, \"w\": 64, \"h\": 48, \"camera_angle_x\": 0.7610127542247298,")
            .empty());
}

TEST_CASE("views without valid pixels are reported; a set of only such views is refused", "[scene][load][left_out]") {
  const SceneFolder folder;
  write_transforms(folder, 9);
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  folder.write("masks/00.png", plain(16, 12, 0, 0, 0));
  folder.write("masks/01.png", plain(16, 12, 0, 0, 0));
  load(folder.path(), options);  // 00 and 08 are held out
  REQUIRE(lines.size() == 3);
  CHECK(
      lines[0].ends_with("transforms.json: masks for 2 of 9 photographs, none for images/02.png; photographs without a "
                         "mask are used completely"));
  lines.erase(lines.begin());
  CHECK(lines[0].find(
            "1 of 7 training views have no pixel in the loss, first: images/01.png: its mask excludes all of it ") !=
        std::string::npos);
  CHECK(lines[1].find("1 of 2 test views have no pixel in the loss, first: images/00.png: ") != std::string::npos);
  folder.write("masks/08.png", plain(16, 12, 0, 0, 0));
  CHECK(message(folder.path())
            .find("2 of 2 test views have no pixel in the loss, first: images/00.png: its mask excludes all of it ") !=
        std::string::npos);
  options.test_images = false;  // and not loaded
  CHECK(load(folder.path(), options).train.size() == 7);

  const SceneFolder transparent;
  for (int i = 0; i < 2; ++i) transparent.write(fmt::format("{}.png", i), plain(8, 8, 0, 0, 0, 0));
  transparent.write("transforms.json", file_of("\"fl_x\": 9,", {frame("0.png", 0), frame("1.png", 1)}));
  options = {};
  options.alpha = AlphaUse::mask;
  CHECK(message(transparent.path(), options).find("which `alpha` mask excludes; ") != std::string::npos);
  options.alpha = AlphaUse::composite;
  CHECK(message(transparent.path(), options).empty());
}

TEST_CASE("errors of test images name the file that lists them", "[scene][load][listing]") {
  const SceneFolder folder;
  for (int i = 0; i < 3; ++i) folder.write(fmt::format("train/{}.png", i), plain(8, 8, 0, 0, 0));
  folder.write("transforms_train.json",
               file_of("\"camera_angle_x\": 0.7,", {frame("train/0", 0), frame("train/1", 1), frame("train/2", 2)}));
  folder.write("transforms_test.json", file_of("\"camera_angle_x\": 0.7,", {frame("test/0", 3), frame("test/1", 4)}));
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  CHECK(names(load(folder.path(), options).test) == std::vector<std::string>{"train/0.png"});  // every 8th
  REQUIRE(lines.size() == 2);
  CHECK(lines[1].find("transforms_train.json: no test view can be used; ") != std::string::npos);
  CHECK(
      lines[0].find("transforms_test.json: skipped 2 of 2 frames whose image is missing, first: test/0 (looked for ") !=
      std::string::npos);
  CHECK(lines[0].find("test/0, also with .png, .jpg") != std::string::npos);
  // Invalid intrinsics too.
  folder.write("transforms_test.json", file_of("\"camera_angle_x\": 0.7, \"cx\": 9,", {frame("train/0", 3)}));
  lines.clear();
  CHECK(load(folder.path(), options).test.size() == 1);  // by test_every instead
  REQUIRE(lines.size() == 2);
  CHECK(lines[1].find("no test view can be used; ") != std::string::npos);
  CHECK(lines[0].find("transforms_test.json: left out 1 photograph: the principal point (9, 4) of train/0.png lies ") !=
        std::string::npos);
}

TEST_CASE("frames listed twice are used once and do not change the split", "[scene][load][listing]") {
  const SceneFolder folder;
  write_transforms(folder, 9);
  const Scene once = load(folder.path(), {});
  std::vector<std::string> frames;
  for (int i = 0; i < 9; ++i) {
    frames.push_back(frame(fmt::format("images/{:02}.png", i), i));
    if (i < 2) frames.push_back(frame(fmt::format("./images/{:02}.png", i), 7));
  }
  frames.push_back(frame("images\\\\00.png", 8));
  folder.write("transforms.json", file_of("\"fl_x\": 20, \"w\": 16, \"h\": 12,", frames));
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  const Scene twice = load(folder.path(), options);
  CHECK(names(twice.test) == names(once.test));
  CHECK(names(twice.train) == names(once.train));
  CHECK(twice.fingerprint == once.fingerprint);
  REQUIRE(lines.size() == 1);
  CHECK(
      lines[0].ends_with("transforms.json: ignored 3 frames that repeat a photograph of an earlier frame: "
                         "images/00.png, images/01.png, images/00.png"));

  const SceneFolder colmap;
  write_colmap(colmap, "sparse/0/", "1 PINHOLE 32 24 40 41 16 12");
  colmap.write(
      "sparse/0/images.txt",
      std::string(
          "1 1 0 0 0 0 0 4 1 sub/b.png\n\n2 0.8 0.6 0 0 0 0 4 1 sub/a.png\n\n3 0.6 0.8 0 0 0 0 4 1 sub/b.png\n\n"));
  colmap.write("sparse/0/points3D.txt", std::string("1 0 0 1 255 0 0 0.1 3 0 2 0 1 0\n"));
  for (const char* name : {"images/sub/a.png", "images/sub/b.png"}) colmap.write(name, plain(32, 24, 100, 0, 0));
  options.test_every = 0;
  const Scene scene = load(colmap.path(), options);
  CHECK(scene.train.size() == 2);
  // Image 3 is the photograph of image 1 with another pose; its observations are ignored.
  CHECK(scene.points.seen_by.at(0) == std::vector<std::uint32_t>{0, 1});
}

TEST_CASE("photographs with paths of another machine are found by name", "[scene][load][names]") {
  const SceneFolder folder;
  const auto found = [&](const std::vector<std::string>& paths, bool outside = false) {
    std::vector<std::string> frames;
    for (std::size_t i = 0; i < paths.size(); ++i) frames.push_back(frame(paths[i], int(i)));
    folder.write("set/transforms.json", file_of("\"fl_x\": 20,", frames));
    LoadOptions options;
    options.test_every = 0;
    options.outside = outside;
    return names(load(folder.path() / "set", options).train);
  };
  using Names = std::vector<std::string>;
  const auto error = [&](const std::vector<std::string>& paths) { return test::message_of([&] { found(paths); }); };
  for (const char* name : {"set/images/a.png", "set/images/left/a.png", "set/images/left/c.png", "set/rgb/b.png",
                           "set/depth/d.png", "outside.png"})
    folder.write(name, plain(16, 12, 9, 9, 9));
  CHECK(found({"images\\\\left\\\\a.png"}) == Names{"images/left/a.png"});
  CHECK(found({"D:\\\\shots\\\\images\\\\left\\\\a.png", "D:/shots/images/a.png"}) ==
        Names{"images/a.png", "images/left/a.png"});
  CHECK(found({"/home/else/where/left/a"}) == Names{"images/left/a.png"});  // the longest matching end of the path
  CHECK(found({"/home/else/where/a.png"}) == Names{"images/a.png"});
  CHECK(found({"/home/else/frames/b.png"}) == Names{"rgb/b.png"});  // the only file of this name
  CHECK(found({"../images/a.png"}) == Names{"images/a.png"});
  CHECK(found({(folder.path() / "set/images/a.png").string()}) == Names{"images/a.png"});
  // A path through a link to the folder.
  std::filesystem::create_directory_symlink(folder.path() / "set", folder.path() / "link");
  CHECK(found({(folder.path() / "link/images/a.png").string()}) == Names{"images/a.png"});
  CHECK(found({"images/../images/a.png"}) == Names{"images/a.png"});

  CHECK(
      error({"/home/else/nowhere.png"}).find("first: /home/else/nowhere.png; put the images next to it (looked for ") !=
      std::string::npos);
  CHECK(error({"/home/else/nowhere.png"}).find("for every ending of that path down to nowhere.png in ") !=
        std::string::npos);
  // The folder left/ is there, and lacks it.
  CHECK(error({"/home/else/left/b.png"}).find("none of its 1 images was found") != std::string::npos);
  CHECK(found({"sub/images/a.png"}) == Names{"images/a.png"});
  CHECK(found({"Images/LEFT/A.PNG"}) == Names{"images/left/a.png"});
  CHECK(found({"images/left/c.jpg"}) == Names{"images/left/c.png"});
  CHECK(found({"file:///home/else/images/left/%61.png"}) == Names{"images/left/a.png"});
  CHECK(found({"c"}) == Names{"images/left/c.png"});
  CHECK(error({"/home/else/d.png"}).find("none of its 1 images was found") !=
        std::string::npos);  // a depth map is no photograph
  CHECK(error({"/home/one/b.png", "/home/two/b.png"})
            .find("/home/one/b.png and /home/two/b.png both match rgb/b.png by name") != std::string::npos);
  // The path of a photograph has priority over names.
  CHECK(found({"/home/one/b.png", "rgb/b.png"}) == Names{"rgb/b.png"});
  for (const std::string& path : {std::string("../outside.png"), std::string("images/../../outside.png"),
                                  (folder.path() / "outside.png").string()}) {
    CAPTURE(path);
    CHECK(error({path}).find("outside.png: lies outside the dataset ") != std::string::npos);
    CHECK(found({path}, true).size() == 1);
  }
  // The same holds for masks and points.
  folder.write("mask.png", plain(16, 12, 255, 0, 0));
  folder.write("set/transforms.json",
               file_of("\"fl_x\": 20,", {frame("images/a.png", 0, ", \"mask_path\": \"../mask.png\"")}));
  CHECK(message(folder.path() / "set").find("../mask.png: lies outside the dataset ") != std::string::npos);
  folder.write("points.ply", std::string("x"));
  folder.write("set/transforms.json",
               file_of("\"fl_x\": 20, \"ply_file_path\": \"../points.ply\",", {frame("images/a.png", 0)}));
  CHECK(message(folder.path() / "set").find("../points.ply: lies outside the dataset ") != std::string::npos);
}

TEST_CASE("a COLMAP model of another machine finds its photographs", "[scene][load][names]") {
  const std::string before = GENERATE("C:/shots/images/", "/home/else/", "..\\", "");
  const SceneFolder folder;
  folder.write("sparse/0/cameras.txt", std::string("1 PINHOLE 32 24 40 41 16 12\n"));
  folder.write("sparse/0/images.txt", "1 1 0 0 0 0 0 4 1 " + before + "b.png\n\n");
  folder.write("sparse/0/points3D.txt", std::string("1 0 0 1 255 0 0 0.1 1 0\n"));
  folder.write("images/b.png", plain(32, 24, 2, 0, 0));
  CHECK(names(load(folder.path(), {}).train) == std::vector<std::string>{"images/b.png"});
}

TEST_CASE("a photograph is turned by its EXIF orientation if its camera was", "[scene][load][exif]") {
  const SceneFolder folder;
  // Black with a white top right corner as stored.
  Image image = plain(32, 16, 0, 0, 0);
  for (int y = 0; y < 8; ++y)
    for (int x = 24; x < 32; ++x)
      for (int c = 0; c < 3; ++c) image.rgba[std::size_t(4 * (32 * y + x) + c)] = 255;
  const auto load_as = [&](int orientation, const std::string& size) {
    folder.write("a.jpg", test::with_orientation(test::jpeg_of(image), orientation));
    folder.write("transforms.json", file_of("\"fl_x\": 20," + size, {frame("a.jpg", 0)}));
    return load(folder.path(), {});
  };
  const auto white = [](const Scene& scene, int x, int y) {
    return pixel(scene.train.at(0), y * scene.train.at(0).image.width + x)[0] > 200;
  };
  const Scene turned = load_as(6, "\"w\": 16, \"h\": 32,");
  CHECK(turned.train[0].image.width == 16);
  CHECK(white(turned, 13, 29));  // clockwise: the right is below
  CHECK(turned.summary.find("; 1 rotated by EXIF orientation to match their cameras") != std::string::npos);
  CHECK(white(load_as(8, "\"w\": 16, \"h\": 32,"), 2, 2));
  // If the camera has the aspect ratio of the stored image or no size, the image stays as stored.
  for (const char* size : {"\"w\": 32, \"h\": 16,", "\"w\": 64, \"h\": 32,", ""}) {
    const Scene stored = load_as(6, size);
    CHECK(stored.train[0].image.width == 32);
    CHECK(white(stored, 29, 2));
    CHECK(stored.summary.find("; EXIF orientation of 1 ignored") != std::string::npos);
    // But it says which way the photograph was held: its left side is up, which is -Y for the camera of
    // blender_pose(0).
    REQUIRE(stored.up);
    CHECK(glm::length(*stored.up - glm::dvec3(0, -1, 0)) < 1e-9);
    CHECK(stored.summary.find("; up direction from EXIF orientation") != std::string::npos);
  }
  CHECK(glm::length(load_as(8, "").up.value() - glm::dvec3(0, 1, 0)) < 1e-9);
  CHECK(glm::length(load_as(3, "").up.value() - glm::dvec3(0, 0, -1)) < 1e-9);
  CHECK_FALSE(turned.up);
  CHECK_FALSE(load_as(1, "").up);
  CHECK(load_as(1, "").summary.find("EXIF") == std::string::npos);
  CHECK(test::message_of([&] {
          load_as(1, "\"w\": 16, \"h\": 32,");
        }).find("a.jpg: is 32 x 16 but its camera is 16 x 32; ") != std::string::npos);
}

TEST_CASE("the colours of a photograph become sRGB, the values of a mask stay", "[scene][load][colours]") {
  const SceneFolder folder;
  // gAMA of 0.11: a dark level is almost black as a colour.
  const std::string gamma("\0\0\0\4gAMA\0\0\x2a\xf8\x57\x28\xd6\x4b", 16);
  const std::string dark = encode_png(plain(16, 12, 9, 9, 9), "a");
  std::string tagged = dark;
  tagged.insert(33, gamma);
  folder.write("a.png", tagged);
  folder.write("mask.png", tagged);
  folder.write("transforms.json", file_of("\"fl_x\": 20,", {frame("a.png", 0, ", \"mask_path\": \"mask.png\"")}));
  const Scene scene = load(folder.path(), {});
  CHECK(pixel(scene.train.at(0), 100)[0] == 0);
  CHECK(has_pixels(scene.train.at(0).image));
}

TEST_CASE("what the decoder works around is one line with a count", "[scene][load]") {
  const SceneFolder folder;
  const std::string jpeg = test::jpeg_of(plain(16, 12, 90, 90, 90));
  folder.write("a.jpg", jpeg);
  for (const char* name : {"b.jpg", "c.jpg"}) folder.write(name, jpeg.substr(0, jpeg.size() - 2));
  folder.write("transforms.json", file_of("\"fl_x\": 20,", {frame("a.jpg", 0), frame("b.jpg", 1), frame("c.jpg", 2)}));
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  load(folder.path(), options);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("transforms.json: 2 of 3 photographs lack the end marker of a JPEG") != std::string::npos);
  CHECK(lines[0].ends_with(": b.jpg, c.jpg"));
}

TEST_CASE("the summary describes the dataset in one line", "[scene][load][summary]") {
  const SceneFolder folder;
  write_transforms(folder, 9);
  CHECK(load(folder.path(), {}).summary ==
        "transforms.json, 9 photographs of 16 x 12 pixels; 1 PINHOLE camera, no distortion");
  write_transforms(folder, 10, "\"k1\": 0.01,");
  std::filesystem::remove(folder.path() / "images/07.png");
  for (const char* mask : {"masks/00.png", "masks/01.png", "masks/02.png"})
    folder.write(mask, plain(16, 12, 255, 255, 255));
  for (const char* copy : {"images_2/03.png", "images_2/04.png"}) folder.write(copy, plain(8, 6, 9, 9, 9));
  std::vector<std::string> lines;
  LoadOptions options;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  options.downscale = 2;
  CHECK(load(folder.path(), options).summary ==
        "transforms.json, 9 photographs of several sizes (images_2 for 2); 1 OPENCV camera, undistorted; "
        "masks for 3 of 9; 1 without an image");
  REQUIRE(lines.size() == 3);
  CHECK(lines[1].find("masks for 3 of 9 photographs, none for images/03.png; ") != std::string::npos);
  CHECK(lines[2].find("images_2 contains 2 of 9 photographs, but not images/00.png; ") != std::string::npos);
  for (int i = 0; i < 10; ++i)
    folder.write(fmt::format("images_2/{:02}.png", i), plain(8, 6, std::uint8_t(9 * i), 9, 9));
  for (int i = 3; i < 10; ++i) folder.write(fmt::format("masks/{:02}.png", i), plain(16, 12, 255, 255, 255));
  lines.clear();
  CHECK(load(folder.path(), options)
            .summary.starts_with("transforms.json, 10 photographs of 8 x 6 pixels (images_2); 1 "));
  REQUIRE(lines.size() == 1);
  CHECK(lines[0].find("the masks of all 10 photographs leave out nothing ") != std::string::npos);

  const SceneFolder colmap;
  write_colmap(colmap, "sparse/0/", "1 SIMPLE_RADIAL 32 24 30 16 12 0");
  for (const char* name : {"images/sub/a.png", "images/sub/b.png"}) colmap.write(name, plain(32, 24, 100, 0, 0));
  options.downscale = 4;
  CHECK(load(colmap.path(), options).summary ==
        "COLMAP, 2 photographs of 32 x 24 pixels, reduced to 8 x 6; 1 SIMPLE_RADIAL camera, no distortion");
}

namespace {

// Writes a JPEG of any size row by row; the left half is dark, the right half bright.
std::string large_jpeg(int width, int height) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &bytes, &size);
  info.image_width = static_cast<unsigned>(width), info.image_height = static_cast<unsigned>(height);
  info.input_components = 3, info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_start_compress(&info, TRUE);
  std::vector<unsigned char> row(std::size_t(3 * width), 40);
  std::fill(row.begin() + 3 * (width / 2), row.end(), 200);
  JSAMPROW rows = row.data();
  for (int y = 0; y < height; ++y) jpeg_write_scanlines(&info, &rows, 1);
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  const std::string content(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return content;
}

// Returns a value of /proc/self/status in MB; 0 if it is missing.
double status_mb(const std::string& key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key + ":")) return std::atof(line.c_str() + key.size() + 1) / 1024;
  return 0;
}

}  // namespace

TEST_CASE("large JPEGs are decoded at reduced size", "[scene][load][reduced]") {
  const SceneFolder folder;
  folder.write("a.jpg", large_jpeg(8000, 6000));
  std::vector<std::string> frames;
  for (int i = 0; i < 4; ++i) {
    frames.push_back(frame(fmt::format("{}.jpg", i), i));
    std::filesystem::create_symlink("a.jpg", folder.path() / fmt::format("{}.jpg", i));
  }
  folder.write("transforms.json", file_of("\"fl_x\": 8000, \"k1\": 0.00001,", frames));
  LoadOptions options;
  options.downscale = 12;  // not a size that the decoder offers
  options.threads = 4;
  std::ofstream("/proc/self/clear_refs") << 5;  // resets the peak
  const double before = status_mb("VmRSS");
  const Scene scene = load(folder.path(), options);
  const double peak = status_mb("VmHWM") - before;
  REQUIRE(scene.train.size() == 3);
  const View& view = scene.train[0];
  CHECK(view.image.width == 667);
  CHECK(view.image.height == 500);
  CHECK(view.camera.fx == Approx(8000 * 667 / 8000.0));
  for (const int y : {1, 250, 498}) {
    CHECK(std::abs(pixel(view, y * 667 + 320)[0] - 40) <= 2);
    CHECK(std::abs(pixel(view, y * 667 + 346)[0] - 200) <= 2);
  }
  // At full size the pixels alone take 183 MB, and several copies are needed.
  CAPTURE(before, peak);
  CHECK(peak < 100);
}

TEST_CASE("lost frames are left out: of one colour, or transparent", "[scene][load]") {
  const SceneFolder folder;
  std::vector<std::string> frames;
  const auto striped = [](int i, std::uint8_t alpha) {
    Image image{16, 12, {}};
    for (int k = 0; k < 16 * 12; ++k) {
      const auto grey = static_cast<std::uint8_t>(20 * (k % 7) + i);
      image.rgba.insert(image.rgba.end(), {grey, grey, grey, alpha});
    }
    return encode_png(image, "striped");
  };
  for (int i = 0; i < 9; ++i) {
    const std::string name = fmt::format("{}.png", i);
    frames.push_back(frame(name, i));
    folder.write(name,
                 i == 3 ? encode_png(plain(16, 12, 0, 0, 0), "plain") : striped(i, std::uint8_t(i == 5 ? 0 : 255)));
  }
  folder.write("transforms.json", file_of("\"fl_x\": 20, \"w\": 16, \"h\": 12,", frames));
  std::vector<std::string> lines;
  LoadOptions options;
  options.test_every = 0;
  options.warn = [&](const std::string& line) { lines.push_back(line); };
  CHECK(load(folder.path(), options).train.size() == 7);
  REQUIRE(lines.size() == 2);
  CHECK_THAT(lines[0], Catch::Contains("one colour everywhere") && Catch::EndsWith(": 3.png"));
  CHECK_THAT(lines[1], Catch::Contains("transparent everywhere") && Catch::EndsWith(": 5.png"));
}
