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

fs::path mask_of(const TransformsFrame& frame, const std::string& name, const std::string& source,
                 const PhotographFiles& files) {
  if (frame.mask_path.empty()) return files.find_mask(name);
  if (const auto mask = files.find_file(frame.mask_path)) return *mask;
  throw Error("{}: mask_path {} does not exist; add the mask or remove the key", source, printable(frame.mask_path));
}

void add_frame(Dataset& dataset, FrameTaker& taker, const TransformsFrame& listed, bool test, const std::string& source,
               const PhotographFiles& files) {
  if (!listed.problem.empty()) {
    dataset.findings.leave_out(source, "photographs", listed.problem, listed.file_path);
    return;
  }
  const auto photograph = taker.find(listed.file_path, test);
  if (!photograph) return;
  Frame frame;
  frame.source = source;
  frame.photograph = *photograph;
  frame.size = image_size(photograph->file);
  frame.mask = mask_of(listed, photograph->name, source, files);
  frame.camera = camera_of(listed, frame.size);
  if (const std::string problem = panorama_problem(listed, frame.camera); !problem.empty()) {
    dataset.findings.leave_out(source, "photographs", problem, listed.file_path);
    return;
  }
  const TransformsIntrinsics& intrinsics = listed.intrinsics;
  if (intrinsics.fx && intrinsics.angle_x)
    frame.focal_times = 2 * *intrinsics.fx * std::tan(0.5 * *intrinsics.angle_x) / frame.camera.width;
  frame.lens = listed.lens;
  frame.model = model_name(listed.lens);
  frame.test = test;
  dataset.frames.push_back(std::move(frame));
}

}  // namespace

Dataset read_blender(const fs::path& root, const PhotographFiles& files) {
  Dataset dataset;
  dataset.format = Format::blender;
  dataset.source = printable((root / "transforms_train.json").string());
  const auto add = [&](const char* file, bool test) {
    const std::string source = printable((root / file).string());
    FrameTaker taker(dataset, files, source);
    const Transforms transforms = parse_transforms(read_file(root / file), source);
    dataset.findings.add(transforms.findings);
    for (const TransformsFrame& frame : transforms.frames) add_frame(dataset, taker, frame, test, source, files);
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
  dataset.findings.add(transforms.findings);

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
  for (const TransformsFrame& frame : transforms.frames) {
    const std::string path = normal_path(frame.file_path);
    const bool is_test = test.contains(path);
    if (dataset.has_split && !is_test && (train.empty() ? validation.contains(path) : !train.contains(path))) continue;
    add_frame(dataset, taker, frame, is_test, dataset.source, files);
  }
  if (!transforms.ply_file_path.empty()) {
    // nerfstudio has already applied its applied_transform to these points.
    const fs::path ply = files.find_file(transforms.ply_file_path).value_or(root / transforms.ply_file_path);
    dataset.points = parse_ply_points(bytes_of(read_file(ply)), printable(ply.string()));
  }
  return dataset;
}

}  // namespace trisoup::scene
