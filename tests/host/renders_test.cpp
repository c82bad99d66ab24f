// Tests engine/run/renders.h: names and contents of the pictures of test views.
#include <catch2/catch.hpp>

#include "image/image_file.h"
#include "run/renders.h"
#include "temporary_folder.h"

using namespace trisoup;

TEST_CASE("masks of co-visible pixels and errors are written beside the rendering", "[renders]") {
  const test::TemporaryFolder folder;
  train::Renders renders(folder.path());
  const scene::View view{"images/a.jpg", {}, {2, 1, {10, 20, 30, 255, 40, 50, 60, 255}}};
  renders.write(view, {0, 0, 0, 1, 1, 1});
  renders.write_covisible(view, {255, 0});
  renders.write_errors(view, {0, 1});
  // Another view of this name gets a number, and so does its mask.
  scene::View other = view;
  other.name = "images_a.jpg";
  renders.write(other, {0, 0, 0, 1, 1, 1});
  renders.write_covisible(other, {0, 255});
  renders.finish();
  CHECK(read_image(folder / "images_a.png").width == 8);
  const Image mask = read_image(folder / "images_a_covisible.png");
  CHECK(mask.width == 2);
  CHECK(mask.rgba == std::vector<std::uint8_t>{255, 255, 255, 255, 0, 0, 0, 255});
  CHECK(read_image(folder / "images_a-2_covisible.png").rgba[0] == 0);
  // The ends of magma.
  CHECK(read_image(folder / "images_a_flip.png").rgba == std::vector<std::uint8_t>{0, 0, 4, 255, 252, 253, 191, 255});
  CHECK(std::filesystem::exists(folder / "images_a-2.png"));
}
