// Tests engine/scene/files/dataset_places.cpp, and how read_dataset() and photograph_files.cpp find the parts of a
// dataset.
#include <catch2/catch.hpp>

#include "scene/datasets/dataset.h"
#include "scene/datasets/unposed.h"
#include "scene/files/dataset_places.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using Catch::Contains;
using test::plain;
using test::SceneFolder;
namespace fs = std::filesystem;

namespace {

/// A COLMAP text model with these names.
void write_model_at(const SceneFolder& folder, const std::string& place, const std::vector<std::string>& names) {
  std::string images;
  for (std::size_t i = 0; i < names.size(); ++i)
    images += fmt::format("{} 1 0 0 0 {} 0 4 1 {}\n\n", i + 1, i, names[i]);
  folder.write(place + "/cameras.txt", std::string("1 PINHOLE 32 24 40 41 16 12\n"));
  folder.write(place + "/images.txt", images);
  folder.write(place + "/points3D.txt", std::string("1 0 0 1 255 0 0 0.1 1 0\n"));
}

void write_pictures(const SceneFolder& folder, const std::vector<std::string>& names) {
  for (const std::string& name : names) folder.write(name, plain(32, 24, 9, 9, 9));
}

struct Read {
  std::vector<std::string> names, findings;
};

Read read_names(const fs::path& path) {
  Read result;
  const Dataset dataset = read_dataset(path, 1);
  for (const Frame& frame : dataset.frames) result.names.push_back(frame.photograph.name);
  result.findings = dataset.findings.lines();
  return result;
}

using PlaceNames = std::vector<std::string>;

}  // namespace

TEST_CASE("COLMAP models and photographs are found in all usual places", "[scene][places]") {
  const char* const model =
      GENERATE("sparse/0", "sparse/1", "sparse", ".", "dense/sparse", "dense/0/sparse", "undistorted/sparse",
               "colmap/sparse/0", "colmap", "colmap_text", "distorted/sparse/0", "other/place/model");
  const char* const images = GENERATE("images", "input", "Images", "image", "rgb", "frames");
  CAPTURE(model, images);
  const SceneFolder folder;
  write_model_at(folder, model, {"a.png", "b.png"});
  const std::string a = std::string(images) + "/a.png", b = std::string(images) + "/b.png";
  write_pictures(folder, {a, b});
  CHECK(has_poses(folder.path()));
  CHECK_FALSE(find_unposed(folder.path()));
  CHECK(read_names(folder.path()).names == PlaceNames{a, b});
  // From a part of a dataset, only the usual places are searched.
  if (model != std::string("other/place/model")) CHECK(read_names(folder / images).names == PlaceNames{a, b});
}

TEST_CASE("photographs near the model come before others", "[scene][places]") {
  const SceneFolder folder;
  write_model_at(folder, "dense/0/sparse", {"a.png"});
  write_pictures(folder, {"images/a.png", "dense/0/images/a.png"});
  CHECK(read_names(folder.path()).names == PlaceNames{"dense/0/images/a.png"});
  const SceneFolder distorted;
  write_model_at(distorted, "distorted/sparse/0", {"a.png"});
  write_pictures(distorted, {"images/a.png", "input/a.png"});
  CHECK(read_names(distorted.path()).names == PlaceNames{"input/a.png"});
  write_model_at(distorted, "sparse/0", {"a.png"});
  CHECK(read_names(distorted.path()).names == PlaceNames{"images/a.png"});
}

TEST_CASE("a folder of a dataset stands for the dataset", "[scene][places]") {
  const SceneFolder folder;
  write_model_at(folder, "set/sparse/0", {"a.png"});
  write_model_at(folder, "set/sparse/1", {"b.png"});
  write_pictures(folder, {"set/images/a.png", "set/images/b.png"});
  const Read one = read_names(folder / "set/sparse/1");
  CHECK(one.names == PlaceNames{"images/b.png"});
  REQUIRE(one.findings.size() == 1);
  CHECK_THAT(one.findings[0], Contains("set/sparse/1: is part of the dataset "));
  CHECK(read_names(folder / "set/images/").names == PlaceNames{"images/a.png"});
  // Two datasets below one folder.
  write_model_at(folder, "second/sparse/0", {"a.png"});
  CHECK_THAT(test::message_of([&] { read_dataset(folder.path(), 1); }), Contains("has COLMAP models in "));
  // Photographs of their own beside other datasets are not part of these.
  write_pictures(folder, {"images/z.png"});
  CHECK_FALSE(has_poses(folder / "images"));
  // The folder of reconstruct() is not taken for a dataset's own model.
  const SceneFolder trained;
  write_pictures(trained, {"a.png"});
  write_model_at(trained, "colmap/sparse/0", {"a.png"});
  CHECK(has_poses(trained.path()));
  trained.write("colmap/made_from.json", std::string("{}"));
  CHECK_FALSE(has_poses(trained.path()));
}

TEST_CASE("names in a COLMAP model may be spelled otherwise than those of the files", "[scene][places][names]") {
  const char* const listed = GENERATE("images/a.png", "A.PNG", "a.jpg", "a", "input/a.png", "./a.png", "/x/y/a.jpeg",
                                      "file:///x/y/a.png", "C:\\x\\a.png");
  CAPTURE(listed);
  const SceneFolder folder;
  write_model_at(folder, "sparse/0", {listed});
  write_pictures(folder, {"images/a.png", "masks/a.png", "images_4/a.png", "depth/a.png"});
  CHECK(read_names(folder.path()).names == PlaceNames{"images/a.png"});
}

TEST_CASE("names in another Unicode form are found", "[scene][places][names]") {
  const SceneFolder folder;
  write_model_at(folder, "sparse/0", {"Co\xCC\x81pia.png"});
  write_pictures(folder, {"images/C\xC3\xB3pia.png"});
  CHECK(read_names(folder.path()).names == PlaceNames{"images/C\xC3\xB3pia.png"});
}

TEST_CASE("a missing photograph is not replaced by another with its name", "[scene][places][names]") {
  const SceneFolder folder;
  write_model_at(folder, "sparse/0", {"left/0.png", "left/1.png", "right/0.png"});
  write_pictures(folder, {"images/left/0.png", "images/right/0.png", "images/right/1.png", "input/left/1.png"});
  CHECK(read_names(folder.path()).names == PlaceNames{"images/left/0.png", "images/right/0.png"});
  // Copies of the photographs in another folder, for paths without folder.
  const SceneFolder copies;
  const std::string pose = ", \"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}";
  copies.write("transforms.json", "{\"fl_x\": 9, \"frames\": [{\"file_path\": \"0.png\"" + pose +
                                      ",{\"file_path\": \"1.png\"" + pose + ",{\"file_path\": \"2.png\"" + pose + "]}");
  write_pictures(copies, {"images/0.png", "images/1.png", "input/0.png", "input/1.png", "input/2.png"});
  CHECK(read_names(copies.path()).names == PlaceNames{"images/0.png", "images/1.png"});
}

TEST_CASE("a name of several photographs is left out with its candidates", "[scene][places][names]") {
  const SceneFolder folder;
  write_model_at(folder, "sparse/0", {"a.png", "b.png"});
  write_pictures(folder, {"one/a.png", "two/a.png", "one/b.png"});
  const Read result = read_names(folder.path());
  CHECK(result.names == PlaceNames{"one/b.png"});
  REQUIRE(result.findings.size() == 1);
  CHECK_THAT(result.findings[0], Contains("images.txt: left out 1 frame: several photographs have the name; ") &&
                                     Contains("a.png (one/a.png, two/a.png)"));
  write_model_at(folder, "sparse/0", {"a.png"});
  CHECK_THAT(test::message_of([&] { read_dataset(folder.path(), 1); }), Contains("a.png (one/a.png, two/a.png)"));
}

TEST_CASE("points of a COLMAP model may be in points3D.ply", "[scene][places]") {
  const SceneFolder folder;
  write_model_at(folder, "sparse/0", {"a.png"});
  write_pictures(folder, {"images/a.png"});
  fs::remove(folder / "sparse/0/points3D.txt");
  CHECK(read_dataset(folder.path(), 1).points.positions.empty());
  folder.write(
      "sparse/0/points3D.ply",
      std::string("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                  "end_header\n0 0 2\n"));
  CHECK(read_dataset(folder.path(), 1).points.positions.size() == 1);
}

TEST_CASE("photographs without poses are found in subfolders, and other pictures are named", "[scene][places]") {
  const SceneFolder folder;
  folder.write("IMG_1.HEIC", std::string("x"));
  folder.write("IMG_2.HEIC", std::string("x"));
  CHECK_FALSE(find_unposed(folder.path()));
  CHECK_THAT(test::message_of([&] { read_dataset(folder.path(), 1); }),
             Contains("2 photographs of type HEIC") && Contains("IMG_1.HEIC, IMG_2.HEIC") && Contains("heif-convert"));
  write_pictures(folder, {"images/front/a.png"});
  folder.write("images/front/b.heic", std::string("x"));
  auto found = find_unposed(folder.path());
  REQUIRE(found);
  CHECK(found->folder == folder / "images/front");
  CHECK(found->names == PlaceNames{"a.png"});
  REQUIRE(found->notes.size() == 1);
  CHECK_THAT(found->notes[0], Contains("images/front: left out 1 picture of types ") && Contains("b.heic"));
  write_pictures(folder, {"images/back/a.png", "masks/front/a.png", "images/back/a_mask.png"});
  found = find_unposed(folder.path());
  REQUIRE(found);
  CHECK(found->folder == folder / "images");
  CHECK(found->names == PlaceNames{"back/a.png", "front/a.png"});
  CHECK(found->masks == folder / "masks");
}

TEST_CASE("poses in JSON of another name, and a file of a COLMAP model as the dataset", "[scene][places]") {
  const SceneFolder folder;
  write_pictures(folder, {"images/a.png", "images/b.png"});
  const std::string pose = R"("transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]])";
  const std::string json = R"({"fl_x": 40, "frames": [{"file_path": "images/a.png", )" + pose +
                           R"(}, {"file_path": "images/b.png", )" + pose + "}]}";
  for (const char* name : {"Transforms.JSON", "poses.json"}) {
    CAPTURE(name);
    folder.write(name, json);
    CHECK(has_poses(folder.path()));
    const Read read = read_names(folder.path());
    CHECK(read.names == PlaceNames{"images/a.png", "images/b.png"});
    REQUIRE(read.findings.size() == 1);
    CHECK_THAT(read.findings[0], Catch::EndsWith(std::string("poses are those of ") + name));
    CHECK(read_names(folder.path() / name).names.size() == 2);
    fs::remove(folder.path() / name);
  }
  // Two of them, and JSON of another kind, say nothing.
  folder.write("one.json", json);
  folder.write("two.json", json);
  CHECK_FALSE(has_poses(folder.path()));
  fs::remove(folder.path() / "two.json");
  folder.write("cameras.json", std::string("[{\"id\": 0}]"));
  CHECK(has_poses(folder.path()));
  fs::remove(folder.path() / "one.json");
  CHECK_FALSE(has_poses(folder.path()));

  write_model_at(folder, "sparse/0", {"a.png", "b.png"});
  for (const char* file : {"sparse/0/images.txt", "sparse/0/cameras.txt"}) {
    CHECK(has_poses(folder.path() / file));
    CHECK(read_names(folder.path() / file).names == PlaceNames{"images/a.png", "images/b.png"});
  }
}

TEST_CASE("folders without poses and photographs say where these lie", "[scene][places]") {
  const SceneFolder folder;
  write_pictures(folder, {"scan/first/a.png"});
  CHECK_THAT(test::message_of([&] { read_dataset(folder.path(), 1); }),
             Contains("photographs only in ") && Contains("scan/first; give that folder"));
  const SceneFolder film;
  film.write("clip.mp4", std::string("x"));
  CHECK_THAT(test::message_of([&] { read_dataset(film.path(), 1); }), Contains("clip.mp4; give that file"));
}
