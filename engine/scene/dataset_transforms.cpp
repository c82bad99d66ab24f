// Datasets described by transforms*.json.
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/dataset.h"
#include "scene/ply_points.h"
#include "scene/transforms_json.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> paths_in(const Transforms& transforms) {
  std::vector<std::string> paths;
  for (const TransformsFrame& frame : transforms.frames) paths.push_back(frame.file_path);
  return paths;
}

constexpr const char* kNoMaskThere = "mask_path does not exist, the photograph is used completely; add the mask";

// Throws Error if no mask_path exists: then the masks are elsewhere.
void check_masks(const Dataset& dataset, const std::vector<TransformsFrame>& frames, const std::string& source) {
  if (dataset.findings.left_out("masks") == 0) return;
  std::string first;
  for (const TransformsFrame& frame : frames)
    if (first.empty()) first = frame.mask_path;
  for (const Frame& frame : dataset.frames)
    if (!frame.mask.empty()) return;
  throw Error("{}: mask_path {} does not exist; add the mask or remove the key", source, printable(first));
}

void add_frame(Dataset& dataset, FrameTaker& taker, const TransformsFrame& listed, bool test, const std::string& source,
               const PhotographFiles& files) {
  const auto photograph = taker.find(listed.file_path, test);
  if (!photograph) return;
  Frame frame;
  frame.source = source;
  frame.photograph = *photograph;
  frame.size = image_size(photograph->file);
  if (!listed.mask_path.empty()) {
    frame.mask = files.find_listed_mask(listed.mask_path).value_or(fs::path());
    if (frame.mask.empty()) dataset.findings.leave_out(source, "masks", kNoMaskThere, listed.mask_path);
  }
  frame.camera = camera_of(listed, frame.size);
  if (listed.fx && listed.angle_x)
    frame.focal_times = 2 * *listed.fx * std::tan(0.5 * *listed.angle_x) / frame.camera.width;
  frame.lens = listed.lens;
  frame.model = listed.lens.model == Lens::Model::fisheye ? "OPENCV_FISHEYE"
                : listed.lens.is_pinhole()                ? "PINHOLE"
                                                          : "OPENCV";
  frame.test = test;
  dataset.frames.push_back(std::move(frame));
}

// nerfstudio has already applied its applied_transform to the points of its PLY file.
PointCloud points_of(const Transforms& transforms, const fs::path& root, const PhotographFiles& files,
                     Dataset& dataset) {
  const std::string& listed = transforms.ply_file_path;
  std::optional<fs::path> ply = listed.empty() ? std::nullopt : files.find_file(listed);
  if (ply) return parse_ply_points(bytes_of(read_file(*ply)), printable(ply->string()));
  const fs::path usual = root / "sparse_pc.ply";  // the name that nerfstudio gives
  const bool there = is_file(usual);
  if (!listed.empty())
    dataset.findings.warn(
        fmt::format("{}: ply_file_path {} does not exist; {}", dataset.source, printable(listed),
                    there ? "the points of sparse_pc.ply are used" : "points are searched for in the photographs"));
  else if (there)
    dataset.findings.warn(
        fmt::format("{}: has no ply_file_path; the points of sparse_pc.ply are used", dataset.source));
  return there ? parse_ply_points(bytes_of(read_file(usual)), printable(usual.string())) : PointCloud{};
}

}  // namespace

Dataset read_blender(const fs::path& root, const PhotographFiles& files) {
  Dataset dataset;
  dataset.format = Format::blender;
  dataset.source = printable((root / "transforms_train.json").string());
  const auto add = [&](const char* file, bool test) {
    const std::string source = printable((root / file).string());
    const Transforms transforms = parse_transforms(read_file(root / file), source);
    FrameTaker taker(dataset, files, source);
    taker.search(paths_in(transforms));
    for (const TransformsFrame& frame : transforms.frames) add_frame(dataset, taker, frame, test, source, files);
    check_masks(dataset, transforms.frames, source);
  };
  add("transforms_train.json", false);
  for (const char* held_out : {"transforms_test.json", "transforms_val.json"})
    if (!dataset.has_split && is_file(root / held_out)) {
      add(held_out, true);
      dataset.has_split = true;
    }
  return dataset;
}

Dataset read_transforms(const fs::path& file, const PhotographFiles& files) {
  const fs::path root = file.has_parent_path() ? file.parent_path() : fs::path(".");
  Dataset dataset;
  dataset.format = Format::transforms;
  dataset.source = printable(file.string());
  const Transforms transforms = parse_transforms(read_file(file), dataset.source);

  // nerfstudio's split: the test views are the test files, else the validation files. The training views are the
  // training files, or without such a list all other files that are not listed for validation.
  const auto normal = [](const std::vector<std::string>& paths) {
    std::set<std::string> result;
    for (const std::string& path : paths) result.insert(normal_path(path));
    return result;
  };
  const auto train = normal(transforms.train_files), validation = normal(transforms.val_files);
  const auto test = transforms.test_files.empty() ? validation : normal(transforms.test_files);
  dataset.has_split = !test.empty();
  FrameTaker taker(dataset, files, dataset.source);
  taker.search(paths_in(transforms));
  for (const TransformsFrame& frame : transforms.frames) {
    const std::string path = normal_path(frame.file_path);
    const bool is_test = test.contains(path);
    if (dataset.has_split && !is_test && (train.empty() ? validation.contains(path) : !train.contains(path))) continue;
    add_frame(dataset, taker, frame, is_test, dataset.source, files);
  }
  check_masks(dataset, transforms.frames, dataset.source);
  dataset.points = points_of(transforms, root, files, dataset);
  return dataset;
}

}  // namespace trisoup::scene
