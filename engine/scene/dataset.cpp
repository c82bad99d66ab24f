#include "scene/dataset.h"

#include "error.h"
#include "printable.h"
#include "read_file.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

Dataset read_dataset(const fs::path& path, double downscale) {
  std::error_code ignored;
  const std::string name = printable(path.string());
  if (!fs::exists(path, ignored)) throw Error("{}: no such file or folder; check the path of the dataset", name);

  fs::path root = path;
  if (is_file(path)) {
    if (path.extension() != ".json") throw Error("{}: not a dataset; give its folder or its transforms.json", name);
    root = path.has_parent_path() ? path.parent_path() : fs::path(".");
    const fs::path file = path.filename();
    const bool split = file == "transforms_train.json" || file == "transforms_val.json" || file == "transforms_test.json";
    if (!split || !is_file(root / "transforms_train.json")) return read_transforms(path, PhotographFiles(root, downscale));
  }

  const PhotographFiles files(root, downscale);
  if (is_file(root / "transforms_train.json")) return read_blender(root, files);
  if (is_file(root / "transforms.json")) return read_transforms(root / "transforms.json", files);
  for (const char* folder : {"sparse/0", "sparse", "."})
    for (const char* images : {"images.bin", "images.txt"})
      if (is_file(root / folder / images)) return read_colmap(root, (root / folder).lexically_normal(), files);
  throw Error(
      "{}: holds neither transforms_train.json nor transforms.json nor a COLMAP model in sparse/0; give the folder of a dataset",
      name);
}

}  // namespace trisoup::scene
