#include "scene/dataset.h"

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/colmap_choice.h"
#include "scene/exported_cameras.h"
#include "scene/unposed.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

/// Returns the folder of a dataset's COLMAP model, or an empty path if there is none.
fs::path colmap_model_in(const fs::path& root) {
  if (const auto choice = largest_model(root / "sparse")) return choice->model.lexically_normal();
  for (const char* folder : {"sparse/0", "sparse", "."})
    for (const char* images : {"images.bin", "images.txt"})
      if (is_file(root / folder / images)) return (root / folder).lexically_normal();
  return {};
}

constexpr const char* kFindPoses =
    "train on it first, which finds the poses, and then use the folder colmap in the output folder of the training";

}  // namespace

bool has_poses(const fs::path& path) {
  if (is_file(path)) return path.extension() == ".json" || is_exported_cameras(path);
  return is_file(path / "transforms_train.json") || is_file(path / "transforms.json") ||
         !colmap_model_in(path).empty() || has_exported_cameras(path);
}

FrameTaker::FrameTaker(Dataset& dataset, const PhotographFiles& files, const std::string& source)
    : dataset_(dataset), files_(files), listing_(dataset.listings.size()) {
  dataset.listings.push_back({source, 0, {}, {}, {}});
}

std::optional<PhotographFile> FrameTaker::find(const std::string& path, bool test) {
  Listing& listing = dataset_.listings[listing_];
  ++listing.listed;
  auto photograph = files_.find(path);
  if (!photograph) {
    listing.missing.push_back(path);
    listing.looked.push_back(files_.looked_for(path));
    return std::nullopt;
  }
  const auto [before, fresh] = taken_.try_emplace({test, photograph->name}, Taken{path, photograph->by_name});
  if (fresh) return photograph;
  // A match by file name only is ambiguous for two different paths: the result would depend on their order.
  if ((before->second.by_name || photograph->by_name) && before->second.path != path)
    throw Error("{}: {} and {} both match {} by file name; put the photographs into the folders named in the paths",
                listing.source, printable(before->second.path), printable(path), printable(photograph->name));
  listing.again.push_back(photograph->name);
  return std::nullopt;
}

Dataset read_dataset(const fs::path& path, double downscale, bool outside) {
  std::error_code ignored;
  const std::string name = printable(path.string());
  if (!fs::exists(path, ignored)) throw Error("{}: no such file or folder; check the path of the dataset", name);

  fs::path root = path;
  if (is_file(path)) {
    if (is_video(path)) throw Error("{}: a video has no poses; {}", name, kFindPoses);
    if (auto dataset = read_exported_cameras(path, downscale, outside)) return *std::move(dataset);
    if (path.extension() != ".json")
      throw Error("{}: not a dataset; give the folder of a dataset or its transforms.json", name);
    root = path.has_parent_path() ? path.parent_path() : fs::path(".");
    const fs::path file = path.filename();
    const bool split =
        file == "transforms_train.json" || file == "transforms_val.json" || file == "transforms_test.json";
    if (!split || !is_file(root / "transforms_train.json"))
      return read_transforms(path, PhotographFiles(root, downscale, outside));
  }

  const PhotographFiles files(root, downscale, outside);
  if (is_file(root / "transforms_train.json")) return read_blender(root, files);
  if (is_file(root / "transforms.json")) return read_transforms(root / "transforms.json", files);
  if (const fs::path model = colmap_model_in(root); !model.empty()) {
    Dataset dataset = read_colmap(root, model, files);
    if (const auto choice = largest_model(root / "sparse"); choice && !choice->line.empty())
      dataset.findings.warn(choice->line);
    return dataset;
  }
  if (auto dataset = read_exported_cameras(root, downscale, outside)) return *std::move(dataset);
  if (find_unposed(root)) throw Error("{}: contains photographs without poses; {}", name, kFindPoses);
  throw Error(
      "{}: contains neither transforms_train.json nor transforms.json nor a COLMAP model in sparse/0 nor a camera "
      "export of Metashape or RealityScan, nor photographs (PNG, JPEG, WebP or TIFF); give the folder of a dataset",
      name);
}

}  // namespace trisoup::scene
