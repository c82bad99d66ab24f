#include "scene/load/shot.h"

#include <algorithm>
#include <cmath>

#include "base/printable.h"
#include "scene/datasets/split_lists.h"
#include "scene/fingerprint.h"
#include "scene/lens/panorama.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

// Applies the EXIF orientation if only the rotated photograph has the proportions of its camera: then it was rotated
// before its pose was estimated. Otherwise the pixels are used as stored, as in COLMAP and nerfstudio.
void turn_to_camera(Frame& frame) {
  if (frame.size.orientation < 5 || frame.size.width == frame.size.height) return;
  const auto fits = [&](int width, int height) {
    return std::abs(double(width) * frame.camera.height / (double(height) * frame.camera.width) - 1) < 0.01;
  };
  if (fits(frame.size.width, frame.size.height) || !fits(frame.size.height, frame.size.width)) return;
  std::swap(frame.size.width, frame.size.height);
  frame.turned = true;
}

// Throws RecordError for a photograph with other proportions than its camera: it was cropped or rotated, so scaled
// intrinsics would be wrong. Differences from rounding to whole pixels are allowed.
void check_aspect(const Frame& frame) {
  const double width_ratio = double(frame.size.width) / frame.camera.width;
  const double height_ratio = double(frame.size.height) / frame.camera.height;
  const bool one_percent = std::abs(width_ratio / height_ratio - 1) > 0.01;
  const bool one_pixel = std::abs(frame.size.width - frame.camera.width * height_ratio) > 1 &&
                         std::abs(frame.size.height - frame.camera.height * width_ratio) > 1;
  if (one_percent && one_pixel)
    throw RecordError(printable(frame.photograph.file.string()),
                      fmt::format("is {} x {} but its camera is {} x {}; export poses and images with the same "
                                  "proportions",
                                  frame.size.width, frame.size.height, frame.camera.width, frame.camera.height));
}

// Appends the shots of a frame.
void plan(const Frame& frame, std::uint32_t index, double downscale, std::vector<Shot>& shots) {
  const auto shrunk = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / downscale))); };
  const bool panorama = frame.lens.is_panorama();
  for (std::size_t face = 0; face < (panorama ? cube_faces().size() : 1); ++face) {
    Shot shot{frame, frame.photograph.name, index, face, {}, {}};
    if (panorama) shot.name.append("/").append(cube_faces()[face].name);
    shot.source = resized(frame.camera, frame.size.width, frame.size.height);
    shot.camera = panorama ? face_camera(shot.source, face) : shot.source;
    if (!frame.photograph.prescaled)
      shot.camera = resized(shot.camera, shrunk(shot.camera.width), shrunk(shot.camera.height));
    shots.push_back(std::move(shot));
  }
}

// Every test_every-th photograph in the order of the shots is a test view.
void split(std::vector<Shot>& shots, int test_every) {
  // The faces of a panorama go together. A single photograph is needed for training.
  const bool hold_out = test_every > 0 && shots.front().index != shots.back().index;
  std::size_t photographs = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (i > 0 && shots[i].index != shots[i - 1].index) ++photographs;
    shots[i].frame.test = hold_out && photographs % std::size_t(test_every) == 0;
  }
}

// Lets the caller change the test views.
void choose_test(std::vector<Shot>& shots, const LoadOptions& options) {
  if (!options.choose_test) return;
  std::vector<std::string> names;
  std::vector<Camera> cameras;
  std::vector<bool> test;
  for (const Shot& shot : shots) {
    names.push_back(shot.name);
    cameras.push_back(shot.camera);
    test.push_back(shot.frame.test);
  }
  options.choose_test(names, cameras, test);
  for (std::size_t i = 0; i < shots.size(); ++i) shots[i].frame.test = test.at(i);
}

}  // namespace

void fit_photographs(Dataset& dataset) {
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  std::vector<bool> keep;
  for (Frame& frame : dataset.frames) {
    turn_to_camera(frame);
    keep.push_back(true);
    try {
      check_aspect(frame);
    } catch (const RecordError& error) {
      bad.leave_out(error, frame.photograph.name);
      keep.back() = false;
    }
  }
  bad.check(static_cast<std::size_t>(std::count(keep.begin(), keep.end(), true)));
  keep_frames(dataset, keep);
}

std::vector<Shot> plan_shots(const Dataset& dataset, double downscale) {
  std::vector<Shot> shots;
  for (std::size_t i = 0; i < dataset.frames.size(); ++i)
    plan(dataset.frames[i], static_cast<std::uint32_t>(i), downscale, shots);
  return shots;
}

void sort_and_split(std::vector<Shot>& shots, bool has_split, const LoadOptions& options) {
  std::stable_sort(shots.begin(), shots.end(),
                   [](const Shot& a, const Shot& b) { return a.frame.photograph.name < b.frame.photograph.name; });
  if (!has_split) split(shots, options.test_every);
  choose_test(shots, options);
}

std::uint64_t fingerprint(const std::vector<Shot>& shots, Format format, double downscale) {
  Fingerprint result;
  result.add(static_cast<int>(format));
  result.add(downscale);
  for (const Shot& shot : shots) {
    result.add(shot.name);
    result.add(shot.frame.test ? 1 : 0);
    result.add(shot.camera.width), result.add(shot.camera.height);
    for (const double value : {shot.camera.fx, shot.camera.fy, shot.camera.cx, shot.camera.cy}) result.add(value);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) result.add(shot.camera.world_to_camera[column][row]);
    add_lens(result, shot.frame.lens);
  }
  return result.value();
}

std::vector<Camera> cameras_of(const std::vector<Shot>& shots) {
  std::vector<Camera> cameras;
  for (const Shot& shot : shots) cameras.push_back(shot.camera);
  return cameras;
}

}  // namespace trisoup::scene
