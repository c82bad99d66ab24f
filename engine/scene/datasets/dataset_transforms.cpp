// Datasets described by transforms*.json.
#include <cmath>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/dataset.h"
#include "scene/datasets/split_lists.h"
#include "scene/formats/ply_points.h"
#include "scene/formats/transforms_json.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> paths_in(const std::vector<TransformsFrame>& frames) {
  std::vector<std::string> paths;
  for (const TransformsFrame& frame : frames) paths.push_back(frame.file_path);
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

void add_frame(Dataset& dataset, FrameTaker& taker, const TransformsFrame& listed, bool test, double depth_unit,
               const std::string& source, const PhotographFiles& files, BadRecords& bad) {
  auto taken = taker.take(listed.file_path, test, bad);
  if (!taken) return;
  Frame& frame = *taken;
  if (!listed.mask_path.empty()) {
    frame.mask = files.find_listed_mask(listed.mask_path).value_or(fs::path());
    if (frame.mask.empty()) dataset.findings.leave_out(source, "masks", kNoMaskThere, listed.mask_path);
  }
  frame.depth_unit = depth_unit;
  if (!listed.depth_path.empty())
    frame.depth = files.find_file(listed.depth_path).value_or(files.root() / listed.depth_path);
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
  dataset.frames.push_back(std::move(frame));
}

// nerfstudio has already applied its applied_transform to the points of its PLY file.
PointCloud points_of(const Transforms& transforms, const fs::path& root, const PhotographFiles& files,
                     Dataset& dataset) {
  const std::string& listed = transforms.ply_file_path;
  std::optional<fs::path> ply = listed.empty() ? std::nullopt : files.find_file(listed);
  if (ply) return parse_ply_points(bytes_of(read_file(*ply)), printable(ply->string()), dataset.findings);
  const fs::path usual = root / "sparse_pc.ply";  // the name that nerfstudio gives
  const bool there = is_file(usual);
  if (!listed.empty())
    dataset.findings.warn(
        fmt::format("{}: ply_file_path {} does not exist; {}", dataset.source, printable(listed),
                    there ? "the points of sparse_pc.ply are used" : "points are searched for in the photographs"));
  else if (there)
    dataset.findings.warn(
        fmt::format("{}: has no ply_file_path; the points of sparse_pc.ply are used", dataset.source));
  return there ? parse_ply_points(bytes_of(read_file(usual)), printable(usual.string()), dataset.findings)
               : PointCloud{};
}

}  // namespace

Dataset read_blender(const fs::path& root, const PhotographFiles& files) {
  Dataset dataset;
  dataset.format = Format::blender;
  dataset.source = printable((root / "transforms_train.json").string());
  const auto add = [&](const Transforms& transforms, bool test, const std::string& source) {
    const std::vector<TransformsFrame>& frames = transforms.frames;
    FrameTaker taker(dataset, files, source);
    taker.search(paths_in(frames));
    BadRecords bad(dataset.findings, source, "photographs");
    for (const TransformsFrame& frame : frames)
      add_frame(dataset, taker, frame, test, transforms.depth_unit, source, files, bad);
    if (!test && dataset.listings.back().missing.empty()) bad.check(dataset.frames.size());
    check_masks(dataset, frames, source);
  };
  add(parse_transforms(read_file(root / "transforms_train.json"), dataset.source, dataset.findings), false,
      dataset.source);
  const std::size_t train = dataset.frames.size();
  for (const char* held_out : {"transforms_test.json", "transforms_val.json"}) {
    if (dataset.frames.size() > train || !is_file(root / held_out)) continue;
    dataset.has_split = true;
    const std::string source = printable((root / held_out).string());
    Transforms transforms;
    Findings findings;
    try {
      transforms = parse_transforms(read_file(root / held_out), source, findings);
    } catch (const Error& error) {  // training does not need the test views
      dataset.findings.warn(error.what());
      continue;
    }
    dataset.findings.add(findings);
    add(transforms, true, source);
  }
  return dataset;
}

Dataset read_transforms(const fs::path& file, const PhotographFiles& files) {
  const fs::path root = file.has_parent_path() ? file.parent_path() : fs::path(".");
  Dataset dataset;
  dataset.format = Format::transforms;
  dataset.source = printable(file.string());
  const Transforms transforms = parse_transforms(read_file(file), dataset.source, dataset.findings);

  const std::vector<std::string> paths = paths_in(transforms.frames);
  const Split split = split_by_lists(paths,
                                     {{dataset.source + ": train_filenames", transforms.train_files},
                                      {dataset.source + ": val_filenames", transforms.val_files},
                                      {dataset.source + ": test_filenames", transforms.test_files}},
                                     dataset.findings);
  dataset.has_split = split.has_test || !transforms.test_files.empty() || !transforms.val_files.empty();
  FrameTaker taker(dataset, files, dataset.source);
  taker.search(paths);
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  for (std::size_t i = 0; i < transforms.frames.size(); ++i)
    if (split.parts[i] != Part::unused)
      add_frame(dataset, taker, transforms.frames[i], split.parts[i] == Part::test, transforms.depth_unit,
                dataset.source, files, bad);
  if (dataset.listings.back().missing.empty()) bad.check(dataset.frames.size());
  check_masks(dataset, transforms.frames, dataset.source);
  dataset.points = points_of(transforms, root, files, dataset);
  return dataset;
}

}  // namespace trisoup::scene
