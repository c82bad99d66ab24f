// Tests viewer/model_selection.h and engine/run/edited_model.h.
#include <catch2/catch.hpp>

#include <filesystem>
#include <vector>

#include "base/error.h"
#include "base/read_file.h"
#include "format/model_file.h"
#include "temporary_folder.h"
#include "viewer/model_selection.h"

using namespace trisoup;
using viewer::Combine;
using viewer::ModelSelection;
using Triangles = std::vector<std::uint32_t>;

namespace {

/// Two strips of two triangles and a single one: pieces 0 1, 2 3 and 4, at x = 0, 10 and 20. The MLP adds nothing, so
/// colours are those of the lattice: red for 0 and 4, green for 1, and blue.
soup::Model strips() {
  soup::Model model;
  for (std::uint32_t t = 0; t < 5; ++t) {
    const float x = 10.0f * float(t / 2);
    for (const glm::vec2 corner :
         {glm::vec2(0, 0), t % 2 ? glm::vec2(1, 1) : glm::vec2(1, 0), glm::vec2(t % 2 ? 0 : 1, 1)})
      model.vertices.emplace_back(x + corner.x, corner.y, 0.0f);
    model.textures.push_back({0, 3 * t, 0, 0});
    for (int s = 0; s < 3; ++s)
      for (int c = 0; c < soup::kChannels; ++c)
        model.lattice.push_back(c == 7 || c == (t % 4 == 0 ? 0 : t == 1 ? 1 : 2) ? 255 : 0);
  }
  return model;
}

struct Opened {
  test::TemporaryFolder folder;
  std::filesystem::path path = folder / "model.glb";
  Opened() { soup::write_model(path, strips(), {}); }
};

}  // namespace

TEST_CASE("pieces, colours and spheres are selected in the numbers of what remains", "[model_selection]") {
  const Opened opened;
  ModelSelection selection(opened.path);
  const auto selected = [&] { return selection.editor().selection(); };
  selection.select_piece(3, Combine::replace);
  CHECK(selected() == Triangles{2, 3});
  selection.select_piece(4, Combine::add);
  CHECK(selected() == Triangles{2, 3, 4});
  selection.select_small_pieces(2);
  CHECK(selected() == Triangles{4});
  selection.select_small_pieces(3);
  CHECK(selected().size() == 5);
  selection.select_outside({{10.5, 0.5, 0}, 2});
  CHECK(selected() == Triangles{0, 1, 4});
  selection.select(Triangles{1, 2}, Combine::replace);
  selection.grow_to_pieces();
  CHECK(selected() == Triangles{0, 1, 2, 3});

  CHECK(!selection.take_model());
  selection.select(Triangles{1}, Combine::replace);
  REQUIRE(selection.editor().remove_selected());
  const auto part = selection.take_model();
  REQUIRE(part);
  CHECK(part->triangles() == 4);
  CHECK(selection.shown() == 4);
  CHECK(!selection.take_model());
  // Shown 1 is now triangle 2 of the file.
  selection.select(Triangles{1}, Combine::replace);
  CHECK(selected() == Triangles{2});
  CHECK(selection.marks() == std::vector<std::uint8_t>{0, 255, 0, 0});
  selection.select_piece(0, Combine::replace);
  CHECK(selected() == Triangles{0});  // its neighbour is gone
  selection.select_small_pieces(2);
  CHECK(selected() == Triangles{0, 4});
  selection.select_alike(3, 0.3, Combine::replace);
  CHECK(selected() == Triangles{0, 4});
  selection.select_alike(1, 0.3, Combine::add);
  CHECK(selected() == Triangles{0, 2, 3, 4});
  while (selection.editor().can_undo()) selection.editor().undo();
  CHECK(selection.take_model()->triangles() == 5);
}

TEST_CASE("what remains is written, and undoing everything gives the same bytes", "[model_selection]") {
  const Opened opened;
  ModelSelection selection(opened.path);
  const std::string before = read_file(opened.path);
  selection.select(Triangles{0, 4}, Combine::replace);
  selection.editor().remove_selected();
  CHECK(selection.editor().changed());
  const std::filesystem::path edited = opened.folder / "edited.glb";
  const std::size_t bytes = selection.write(edited);
  CHECK(bytes == std::filesystem::file_size(edited));
  CHECK(!selection.editor().changed());
  const soup::Model written = soup::read_model(edited).model, all = soup::read_model(opened.path).model;
  REQUIRE(written.triangles() == 3);
  CHECK(std::equal(written.vertices.begin(), written.vertices.end(), all.vertices.begin() + 3));
  CHECK(std::equal(written.lattice.begin(), written.lattice.end(), all.lattice.begin() + 24));
  selection.editor().undo();
  selection.write(edited);
  CHECK(read_file(edited) == before);
  CHECK_THROWS_WITH(selection.write(opened.path), Catch::Contains("is the model itself"));
  std::filesystem::create_symlink(opened.path, opened.folder / "link.glb");
  CHECK_THROWS_WITH(selection.write(opened.folder / "link.glb"), Catch::Contains("is the model itself"));
  CHECK_THROWS_WITH(selection.write(opened.folder / "edited.ply"), Catch::Contains("ends with .glb"));
  CHECK_THROWS_AS(selection.write(opened.folder / "none" / "edited.glb"), Error);
  CHECK(read_file(opened.path) == before);
}
