// Tests engine/scene/text/name_key.cpp, mask_name.cpp and picture_tree.cpp.
#include <catch2/catch.hpp>

#include "scene/files/mask_name.h"
#include "scene/files/photograph_files.h"
#include "scene/files/picture_tree.h"
#include "scene/text/name_key.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using namespace trisoup::scene;

TEST_CASE("names that differ in case or Unicode form have one key", "[scene][names]") {
  CHECK(name_key("P00.PNG") == name_key("p00.png"));
  CHECK(name_key("C\xC3\xB3pia") == name_key("co\xCC\x81PIA"));  // composed and decomposed
  CHECK(name_key("\xE3\x82\xAC.png") == name_key("\xE3\x82\xAB\xE3\x82\x99.PNG"));
  CHECK(name_key("\xC3\x84") == name_key("\xC3\xA4"));
  CHECK(name_key("C\xF3pia") == name_key("C\xC3\xB3pia"));  // Latin-1
  CHECK(name_key("a") != name_key("\xC3\xA4"));
  CHECK(name_key("") == "");
  CHECK(path_keys("A/./B") == std::vector<std::string>{"a", "b"});
}

TEST_CASE("the stem of a picture's name keeps dots that start no extension", "[scene][names]") {
  CHECK(picture_stem("a.PNG") == "a");
  CHECK(picture_stem("a.heic") == "a");
  CHECK(picture_stem("r_0.5") == "r_0.5");
  CHECK(picture_stem("a.jpg.png") == "a.jpg");
}

TEST_CASE("URLs of files become paths", "[scene][names]") {
  CHECK(without_url("file:///data/a%20b%C3%A9.png") == "/data/a b\xC3\xA9.png");
  CHECK(without_url("FILE://localhost/data/a.png") == "/data/a.png");
  CHECK(without_url("file:/data/a.png") == "/data/a.png");
  CHECK(without_url("file:///C:/a.png") == "C:/a.png");
  CHECK(without_url("https://host/images/a.png?size=1") == "/images/a.png");
  for (const char* path : {"C:/a%20.png", "a:b.png", "images/a%20b.png", "/a.png", "note: a.png", "", "file", ":"})
    CHECK(without_url(path) == path);
  CHECK(without_escapes("a%2") == "a%2");
  CHECK(without_escapes("%zz%00") == "%zz%00");  // no zero bytes in names
  CHECK(normal_path("file:///data/x/../a.png") == "/data/a.png");
}

TEST_CASE("names of masks", "[scene][masks]") {
  const auto belongs = [](const char* mask, const char* photograph) {
    const auto names = mask_name(mask).photographs;
    return std::find(names.begin(), names.end(), photograph) != names.end();
  };
  for (const char* mask : {"x.png", "X.PNG", "x.jpg.png", "x_mask.png", "x.mask.png", "x-mask.tif", "x.jpg.mask.png",
                           "x.mask", "mask_x.webp", "dynamic_mask_x.png", "x_masks.jpg", "MASK-x.png", "x mask.png"}) {
    CAPTURE(mask);
    CHECK(belongs(mask, "x"));
    CHECK_FALSE(belongs(mask, "y"));
  }
  CHECK(belongs("x.jpg.mask.png", "x.jpg"));
  CHECK(belongs("front_mask.png", "front_mask"));
  CHECK_FALSE(belongs("damask.png", "da"));
  CHECK_FALSE(mask_name("x.png").marked);
  CHECK_FALSE(mask_name("mask.png").marked);
  CHECK(mask_name("x_mask.png").marked);
  CHECK_FALSE(mask_name("x_mask.png").dynamic);
  CHECK(mask_name("dynamic_mask_x.png").dynamic);

  CHECK(mask_folder_kind("masks") == MaskFolderKind::firm);
  CHECK(mask_folder_kind("mask_4") == MaskFolderKind::firm);
  CHECK(mask_folder_kind("segmentation") == MaskFolderKind::loose);
  CHECK(mask_folder_kind("sky_masks") == MaskFolderKind::other);
  CHECK(mask_folder_kind("images") == MaskFolderKind::none);
  CHECK(mask_folder_reduction("masks_4") == 4);
  CHECK(mask_folder_reduction("masks_") == 0);
  CHECK(mask_folder_reduction("masks_123456789012") == 0);
}

TEST_CASE("the tree of pictures follows links once and leaves out hidden files", "[scene][names]") {
  const test::SceneFolder folder;
  for (const char* name :
       {"images/Left/A.png", "images/._b.png", ".cache/c.png", "images_4/a.png", "masks/a.png", "x.txt"})
    folder.write(name, std::string("x"));
  std::filesystem::create_directory_symlink(folder.path(), folder.path() / "images/loop");
  const PictureTree tree(folder.path());
  CHECK(tree.pictures().size() == 3);
  REQUIRE(tree.named("a.png").size() == 3);
  REQUIRE(tree.stemmed("a").size() == 3);
  CHECK(tree.has_folder({"images", "left"}, 0, false));
  CHECK(tree.has_folder({"x", "left"}, 1, false));
  CHECK_FALSE(tree.has_folder({"images"}, 0, false));  // holds no picture itself
  CHECK_FALSE(tree.has_folder({"masks"}, 0, false));
  CHECK(tree.has_folder({"masks"}, 0, true));
  for (const TreePicture& picture : tree.pictures()) {
    CHECK(picture.aside == (picture.folders.front() == "masks"));
    CHECK(picture.reduced_by == (picture.folders.front() == "images_4" ? 4 : 0));
  }
}
