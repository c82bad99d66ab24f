// Fuzzes the reader of the published viewer's files. The first byte selects a file of a valid scene, and the remaining
// bytes replace its content.
#include <array>
#include <string>

#include "base/read_file.h"
#include "format/published.h"
#include "scene_reader.h"
#include "soup/texture_table.h"
#include "temporary_folder.h"

namespace {

constexpr std::array<const char*, 5> kFiles{"mesh.ply", "lut0.png", "lut1.png", "mlp_weights.json", "meta.json"};

/// A scene of one triangle with three samples.
struct Scene {
  trisoup::test::TemporaryFolder folder;
  std::array<std::string, kFiles.size()> sound;

  Scene() {
    using namespace trisoup;
    soup::Model model;
    model.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::array levels{soup::TextureLevels{0, 0}};
    model.textures = soup::make_texture_table(levels).entries;
    model.lattice.assign(3 * 8, 200);
    soup::write_published(folder.path(), "s", model, {0, 1, 0});
    for (std::size_t i = 0; i < kFiles.size(); ++i) sound[i] = read_file(folder / "s" / kFiles[i]);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  static const Scene scene;
  if (size == 0) return 0;
  const std::size_t which = data[0] % kFiles.size();
  const std::string name = std::string("s/") + kFiles[which];
  scene.folder.file(name, std::string(reinterpret_cast<const char*>(data) + 1, size - 1));
  fuzz::expect_result_or_error([&] { soup::read_published(scene.folder / "s"); });
  scene.folder.file(name, scene.sound[which]);
  return 0;
}
