// Fuzzes paths of photographs and masks as files list them.
#include <filesystem>
#include <fstream>

#include "scene/files/mask_name.h"
#include "scene/files/photograph_files.h"
#include "scene/text/name_key.h"
#include "scene_reader.h"
#include "temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  static const test::TemporaryFolder folder;
  static const bool written = [] {
    for (const char* name : {"images/left/p00.png", "images/right/p00.png", "images/p01.jpg", "masks/p00.png"}) {
      std::filesystem::create_directories((folder.path() / name).parent_path());
      std::ofstream(folder.path() / name) << "x";
    }
    return true;
  }();
  const std::string path(reinterpret_cast<const char*>(data), size);
  return fuzz::expect_result_or_error([&] {
    if (!written) return;
    scene::mask_name(path);
    scene::mask_folder_kind(scene::name_key(path));
    const scene::PhotographFiles files(folder.path(), 1);
    const auto found = files.find(path);
    if (found && !std::filesystem::exists(found->file)) __builtin_trap();
    files.find_file(path);
    files.looked_for(path);
  });
}
