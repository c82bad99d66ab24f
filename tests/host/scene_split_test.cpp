// Tests engine/scene/datasets/split_lists.h and colmap_choice.h, and pictures that do not fit, through load().
#include <catch2/catch.hpp>

#include <cmath>

#include "packed.h"
#include "scene/datasets/split_lists.h"
#include "scene/formats/colmap_choice.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;
using test::plain;
using test::SceneFolder;

namespace {

using Names = std::vector<std::string>;

struct Loaded {
  Names train, test, lines;
};

Loaded load_names(const SceneFolder& folder, int test_every = 2) {
  Loaded loaded;
  LoadOptions options;
  options.test_every = test_every;
  options.warn = [&](const std::string& line) { loaded.lines.push_back(line); };
  const Scene scene = load(folder.path(), options);
  for (const View& view : scene.train) loaded.train.push_back(view.name);
  for (const View& view : scene.test) loaded.test.push_back(view.name);
  return loaded;
}

std::string frame_of(const std::string& path, int i) {
  const double a = 0.6 * i, c = std::cos(a), s = std::sin(a);
  return fmt::format("{{\"file_path\": \"{}\", \"transform_matrix\": [[{},0,{},{}],[{},0,{},{}],[0,1,0,0],[0,0,0,1]]}}",
                     path, -s, c, 4 * c, c, s, 4 * s);
}

std::string frames_of(const Names& paths, const std::string& shared = "") {
  std::string text;
  for (std::size_t i = 0; i < paths.size(); ++i) text += (i ? "," : "") + frame_of(paths[i], int(i));
  return "{\"fl_x\": 20, \"w\": 16, \"h\": 12, " + shared + "\"frames\": [" + text + "]}";
}

// Four photographs images/a.png to images/d.png.
void write_four(const SceneFolder& folder, const std::string& shared = "") {
  const Names paths{"images/a.png", "images/b.png", "images/c.png", "images/d.png"};
  for (const std::string& path : paths) folder.write(path, plain(16, 12, 9, 9, 9));
  folder.write("transforms.json", frames_of(paths, shared));
}

void write_split_model(const SceneFolder& folder, const std::string& model, const Names& names, int points = 1) {
  folder.write(model + "cameras.txt", std::string("1 PINHOLE 16 12 20 20 8 6\n"));
  std::string images, cloud;
  for (std::size_t i = 0; i < names.size(); ++i)
    images += fmt::format("{} 1 0 0 0 {} 0 4 1 {}\n\n", i + 1, 0.1 * double(i), names[i]);
  for (int i = 0; i < points; ++i) cloud += fmt::format("{} 0 0 1 255 0 0 0.1 1 0 2 0\n", i + 1);
  folder.write(model + "images.txt", images);
  folder.write(model + "points3D.txt", cloud);
  for (const std::string& name : names) folder.write("images/" + name, plain(16, 12, 9, 9, 9));
}

LoadOptions all_for_training() {
  LoadOptions options;
  options.test_every = 0;
  return options;
}

bool contains(const Loaded& loaded, const std::string& text) {
  for (const std::string& line : loaded.lines)
    if (line.find(text) != std::string::npos) return true;
  return false;
}

}  // namespace

TEST_CASE("entries of a test list match paths that are spelt otherwise", "[scene][split]") {
  const auto tests = [](const Names& paths, const Names& entries, std::size_t unmatched = 0) {
    Findings findings;
    const Split split = split_by_lists(paths, {{"train", {}}, {"val", {}}, {"test", entries}}, findings);
    CHECK(findings.lines().size() == (unmatched > 0 ? 1 : 0));
    if (unmatched > 0)
      CHECK(findings.lines().at(0).starts_with(
          fmt::format("test: {} of {} entries match no photograph of the dataset", unmatched, entries.size())));
    Names found;
    for (std::size_t i = 0; i < paths.size(); ++i)
      if (split.parts[i] == Part::test) found.push_back(paths[i]);
    return found;
  };
  const Names paths{"images/a.png", "./images/b.png", "images/left/c.png", "images/right/c.png", "images/r_0.5"};
  for (const char* entry :
       {"images/b.png", "./images/b.png", "b.png", "b", "B.PNG", "images\\b.png", "C:\\x\\images\\b.png",
        "/home/else/images/b.png", "../images/b.png", "file:///data/b.png", "b.jpg", "images/b"}) {
    CAPTURE(entry);
    CHECK(tests(paths, {entry}) == Names{"./images/b.png"});
  }
  CHECK(tests(paths, {"left/c.png"}) == Names{"images/left/c.png"});
  CHECK(tests(paths, {"D:\\Right\\C.JPG", "r_0.5.png"}) == (Names{"images/right/c.png", "images/r_0.5"}));
  CHECK(tests(paths, {"c.png"}, 1).empty());       // either of two
  CHECK(tests(paths, {"left/a.png"}, 1).empty());  // missing in a folder that is there
  CHECK(tests(paths, {"elsewhere/a.png"}) == Names{"images/a.png"});
  CHECK(tests(paths, {"a.png", "x.png", "", "/", "..", "y"}, 5) == Names{"images/a.png"});
  CHECK(tests({"images/a.png", "images/a.png"}, {"a"}).size() == 2);  // one path, twice
}

TEST_CASE("nerfstudio's lists: parts, and lists that hold out nothing", "[scene][split]") {
  const SceneFolder folder;
  const auto with = [&](const std::string& lists) {
    write_four(folder, lists);
    return load_names(folder);
  };
  const Names every_second{"images/a.png", "images/c.png"};
  Loaded loaded = with("\"test_filenames\": [\"D:\\\\shots\\\\b.png\"],");
  CHECK(loaded.test == Names{"images/b.png"});
  CHECK(loaded.train.size() == 3);
  CHECK(loaded.lines.empty());
  loaded = with("\"train_filenames\": [\"a.png\"], \"val_filenames\": [\"b.png\"], \"test_filenames\": [\"c.png\"],");
  CHECK(loaded.train == Names{"images/a.png"});
  CHECK(loaded.test == Names{"images/c.png"});
  loaded = with("\"val_filenames\": [\"b.png\"], \"test_filenames\": [\"nothing.png\"],");
  CHECK(loaded.test == Names{"images/b.png"});
  CHECK(contains(loaded, "test_filenames: 1 of 1 entries match no photograph"));
  loaded = with("\"test_filenames\": [\"nothing.png\"],");
  CHECK(loaded.test == every_second);
  CHECK(contains(loaded, "no test view can be used; test views follow from `test_every` instead"));
  const std::string all = "[\"a.png\", \"b.png\", \"c.png\", \"d.png\"]";
  for (const std::string& lists :
       {"\"test_filenames\": " + all + ",", "\"train_filenames\": " + all + ", \"test_filenames\": " + all + ","}) {
    loaded = with(lists);
    CHECK(loaded.test == every_second);
    CHECK(contains(loaded, "every training view is a test view too"));
  }
  loaded = with("\"train_filenames\": [\"a.png\", \"b.png\", \"c.png\"],");
  CHECK(loaded.test == every_second);
  CHECK(loaded.train == Names{"images/b.png"});
  CHECK(contains(loaded, "train_filenames: leaves out 1 of 4 photographs"));
  CHECK(with("\"test_filenames\": [], \"val_filenames\": [],").lines.empty());
}

TEST_CASE("Blender: test files that hold out nothing", "[scene][split]") {
  const SceneFolder folder;
  write_four(folder);
  const auto with = [&](const Names& train, const Names& test) {
    folder.write("transforms_train.json", frames_of(train));
    folder.write("transforms_test.json", frames_of(test));
    return load_names(folder);
  };
  const Names all{"images/a", "images/b", "images/c", "images/d"}, first{"images/a", "images/b"};
  const Names a_c{"images/a.png", "images/c.png"}, b_d{"images/b.png", "images/d.png"};
  Loaded loaded = with(all, all);
  CHECK(loaded.test == a_c);
  CHECK(loaded.train == b_d);
  CHECK(contains(loaded, "every training view is a test view too"));
  loaded = with(all, {});
  CHECK(loaded.test == a_c);
  CHECK(contains(loaded, "no test view can be used"));
  loaded = with(all, {"test/missing"});
  CHECK(loaded.test == a_c);
  loaded = with(all, first);
  CHECK(loaded.test == Names{"images/a.png", "images/b.png"});
  CHECK(loaded.train == Names{"images/c.png", "images/d.png"});
  CHECK(contains(loaded, "2 photographs are both training and test views; used only for testing"));
  loaded = with(first, all);
  CHECK(loaded.train == Names{"images/a.png", "images/b.png"});
  CHECK(loaded.test == Names{"images/c.png", "images/d.png"});
  CHECK(contains(loaded, "used only for training"));
  loaded = with({"images/a", "images/b", "images/c"}, {"images/c", "images/d"});  // training keeps its views
  CHECK(loaded.train == Names{"images/a.png", "images/b.png", "images/c.png"});
  CHECK(loaded.test == Names{"images/d.png"});
  loaded = with(first, {"images/c"});
  CHECK(loaded.test == Names{"images/c.png"});
  CHECK(loaded.lines.empty());
  folder.write("transforms_test.json", std::string("{\"frames\": [{}]}"));
  loaded = load_names(folder);
  CHECK(loaded.test == Names{"images/a.png"});
  CHECK(contains(loaded, "transforms_test.json: frames[0].file_path is missing"));
  // Training photographs that are missing are an Error, not a reason to train on test views.
  folder.write("transforms_train.json", frames_of({"train/x"}));
  folder.write("transforms_test.json", frames_of(all));
  CHECK(test::message_of([&] { load_names(folder); }).find("no training views remain") != std::string::npos);
}

TEST_CASE("COLMAP: lists of test views beside the model", "[scene][split]") {
  const SceneFolder folder;
  write_split_model(folder, "sparse/0/", {"a.png", "b.png", "c.png", "d.png"});
  folder.write("sparse/0/test.txt", std::string("\xef\xbb\xbf# held out\r\nB.png\r\n\r\nimages/c.png\r\n"));
  Loaded loaded = load_names(folder);
  CHECK(loaded.test == Names{"images/b.png", "images/c.png"});
  CHECK(loaded.train == Names{"images/a.png", "images/d.png"});
  CHECK(loaded.lines.empty());
  std::filesystem::remove(folder.path() / "sparse/0/test.txt");
  folder.write("test_list.txt", std::string("d.png\n"));
  CHECK(load_names(folder).test == Names{"images/d.png"});
  folder.write("train_list.txt", std::string("a.png\nb.png\n"));
  CHECK(load_names(folder).train == Names{"images/a.png", "images/b.png"});
  folder.write("test_list.txt", std::string("e.png\n"));
  loaded = load_names(folder);
  CHECK(loaded.train == Names{"images/b.png"});
  CHECK(contains(loaded, "test_list.txt: 1 of 1 entries match no photograph"));
}

TEST_CASE("the largest of several COLMAP models is used", "[scene][colmap][choice]") {
  const SceneFolder folder;
  CHECK_FALSE(largest_model(folder.path() / "sparse"));
  write_split_model(folder, "sparse/0/", {"a.png", "b.png"}, 9);
  CHECK(largest_model(folder.path() / "sparse")->line.empty());
  CHECK(load_names(folder, 0).lines.empty());
  write_split_model(folder, "sparse/1/", {"a.png", "b.png", "c.png"});
  write_split_model(folder, "sparse/10/", {"a.png", "b.png", "d.png"}, 3);
  write_split_model(folder, "sparse/2/", {"a.png", "b.png", "e.png"}, 3);
  write_split_model(folder, "sparse/x3/", {"a.png", "b.png", "c.png", "d.png"});
  const auto choice = largest_model(folder.path() / "sparse");
  CHECK(choice->model == folder.path() / "sparse/2");
  CHECK(choice->images == 3);
  CHECK(choice->points == 3);
  CHECK(choice->line == (folder.path() / "sparse").string() +
                            ": contains 4 models; uses the largest one, 2 with 3 images, and not 10 (3), 1 (3), 0 (2)");
  const Loaded loaded = load_names(folder, 0);
  CHECK(loaded.train == Names{"images/a.png", "images/b.png", "images/e.png"});
  CHECK(loaded.lines == Names{choice->line});
  // Binary: the number at the start, unless the file is too small for it.
  folder.write("sparse/3/cameras.bin", std::string("x"));
  folder.write("sparse/3/images.bin", test::pack(std::uint64_t(1) << 40) + std::string(1000, ' '));
  CHECK(largest_model(folder.path() / "sparse")->model == folder.path() / "sparse/2");
  folder.write("sparse/3/images.bin", test::pack(std::uint64_t(4)) + std::string(1000, ' '));
  CHECK(largest_model(folder.path() / "sparse")->model == folder.path() / "sparse/3");
  std::filesystem::remove(folder.path() / "sparse/3/cameras.bin");
  CHECK(largest_model(folder.path() / "sparse")->model == folder.path() / "sparse/2");
}

TEST_CASE("photographs that do not fit or cannot be read are left out by name", "[scene][load][records]") {
  const SceneFolder folder;
  write_split_model(folder, "sparse/0/", {"a.png", "b.png", "c.png", "d.png"});
  folder.write("images/b.png", plain(12, 16, 9, 9, 9));
  folder.write("images/c.png", std::string("no picture"));
  Loaded loaded = load_names(folder, 0);
  CHECK(loaded.train == Names{"images/a.png", "images/d.png"});
  CHECK(contains(loaded, "images.txt: left out 1 photograph: is 12 x 16 but its camera is 16 x 12; "));
  CHECK(contains(loaded, "left out 1 photograph: not a picture of a known type"));
  // Views of points refer to the photographs that are left.
  const Scene scene = load(folder.path(), all_for_training());
  CHECK(scene.points.seen_by.at(0) == std::vector<std::uint32_t>{0});
  folder.write("images/a.png", plain(12, 16, 9, 9, 9));
  folder.write("images/d.png", plain(12, 16, 9, 9, 9));
  CHECK(test::message_of([&] { load_names(folder); })
            .ends_with("a.png: is 12 x 16 but its camera is 16 x 12; export poses and images with the same proportions "
                       "(none of its 3 photographs can be used)"));
}

TEST_CASE("COLMAP images without their camera, and with one id", "[scene][load][records]") {
  const SceneFolder folder;
  write_split_model(folder, "sparse/0/", {"a.png", "b.png", "c.png"});
  folder.write("sparse/0/images.txt", std::string("1 1 0 0 0 0 0 4 1 a.png\n\n2 1 0 0 0 1 0 4 9 b.png\n\n"
                                                  "2 1 0 0 0 1 0 4 1 c.png\n\n"));
  const Loaded loaded = load_names(folder, 0);
  CHECK(loaded.train == Names{"images/a.png", "images/c.png"});
  CHECK(contains(loaded, "left out 1 photograph: the camera is missing in cameras.txt; export the model again: b.png"));
  CHECK(contains(loaded, "1 image ids appear more than once, first: 2; "));
  const Scene scene = load(folder.path(), all_for_training());
  CHECK(scene.points.seen_by.at(0) == std::vector<std::uint32_t>{0});
  folder.write("sparse/0/cameras.txt", std::string("8 PINHOLE 16 12 20 20 8 6\n"));
  CHECK(test::message_of([&] { load_names(folder); })
            .ends_with("images.txt: a.png uses camera 1, which is missing in cameras.txt; export the model again (none "
                       "of its 3 photographs can be used)"));
}

TEST_CASE("a sparse point too far away in normalised units is left out", "[scene][load][records]") {
  const SceneFolder folder;
  write_split_model(folder, "sparse/0/", {"a.png", "b.png", "c.png"});
  // The cameras are 1e-3 apart, so that normalised coordinates are larger than those of the file.
  folder.write("sparse/0/images.txt", std::string("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 1e-3 0 0 1 b.png\n\n"
                                                  "3 1 0 0 0 0 1e-3 0 1 c.png\n\n"));
  const std::string near = "1 0 0 1e-3 9 8 7 0.1 1 0 2 0\n2 0 0 2e-3 6 5 4 0.1 1 0\n",
                    far = "3 0 9e17 1 1 2 3 0.2 3 0\n";
  folder.write("sparse/0/points3D.txt", far + near);
  const Scene scene = load(folder.path(), all_for_training());
  REQUIRE(scene.points.positions.size() == 2);
  CHECK(scene.points.colours == std::vector<glm::u8vec3>{{9, 8, 7}, {6, 5, 4}});
  CHECK(scene.points.seen_by == std::vector<std::vector<std::uint32_t>>{{0, 1}, {0}});
  CHECK(contains(load_names(folder, 0), "left out 1 sparse points that are too far away"));
}
