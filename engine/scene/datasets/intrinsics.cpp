#include "scene/datasets/intrinsics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/printable.h"
#include "scene/lens/panorama.h"

namespace trisoup::scene {
namespace {

/// Returns the size of an image with the principal point at its centre, as a multiple of the camera's size. Returns
/// nullopt if that multiple is near 1 or differs between the axes.
std::optional<double> middle_of_another_size(const Camera& camera) {
  const double x = 2 * camera.cx / camera.width, y = 2 * camera.cy / camera.height;
  // In a real camera, the principal point is off the centre by a few percent, and differently along each axis.
  const bool alike = x > 0 && y > 0 && std::abs(x / y - 1)<0.1, far = std::abs(std::sqrt(x * y) - 1)> 0.2;
  return alike && far ? std::optional(std::sqrt(x * y)) : std::nullopt;
}

std::string likely_cause(const Camera& camera, double times) {
  return fmt::format(
      "these are likely the intrinsics of the photograph at {:.0f} x {:.0f} pixels; state that size with them (w and h "
      "in transforms.json, the camera's size in a COLMAP model), or divide fx, fy, cx and cy by {:.3g}",
      times * camera.width, times * camera.height, times);
}

constexpr double kMostLost = 1.0 / 3, kLeastShown = 0.25;

/// How much of a photograph and of its undistorted image a lens can use, as shares of their pixels.
struct LensUse {
  double lost = 0;   // of the photograph, beyond the radius at which the lens folds over inside the undistorted image
  double shown = 1;  // of the undistorted image
  double fold = 0;   // that radius in pixels; 0: the lens does not fold over there
};

LensUse use_of(const Camera& camera, const Lens& lens) {
  constexpr int cells = 32;
  const glm::dvec2 focal(camera.fx, camera.fy), principal(camera.cx, camera.cy), size(camera.width, camera.height);
  const glm::dvec2 farthest = glm::max(glm::abs(principal), glm::abs(size - principal)) / focal;
  const double corner = glm::length(farthest), limit = lens.growing_until(corner);
  const std::optional<double> fold = limit < corner ? lens.folds_at() : std::nullopt;
  int lost = 0, shown = 0;
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x) {
      const glm::dvec2 point = (size * (glm::dvec2(x, y) + 0.5) / double(cells) - principal) / focal;
      if (fold && glm::length(point) > *fold) ++lost;
      const glm::dvec2 source = lens.distort(point) * focal + principal;
      const bool inside = source.x >= 0 && source.y >= 0 && source.x <= size.x && source.y <= size.y;
      if (inside && glm::length(point) <= limit) ++shown;
    }
  constexpr double all = double(cells) * cells;
  return {lost / all, shown / all, fold ? *fold * std::max(camera.fx, camera.fy) : 0.0};
}

/// Frames with the same kind of problem. The first one's values stand for all.
struct Doubts {
  std::string first, source;
  std::vector<std::size_t> frames;
};

/// Findings about cameras, by kind.
class CameraDoubts {
 public:
  enum Kind { outside, normalised, focal_length, fold, strong, kinds };

  void add(Kind kind, std::size_t index, const Frame& frame, const std::string& problem) {
    Doubts& doubts = doubts_[kind];
    if (doubts.frames.empty()) doubts.first = problem, doubts.source = frame.source;
    doubts.frames.push_back(index);
  }

  /// Leaves out the frames found. Throws Error if none is left.
  void leave_out(Dataset& dataset) const {
    std::vector<bool> out(dataset.frames.size(), false);
    for (const Doubts& doubts : doubts_)
      for (const std::size_t i : doubts.frames) {
        out[i] = true;
        dataset.findings.leave_out(doubts.source, "photographs", doubts.first, dataset.frames[i].photograph.name);
      }
    std::map<std::uint32_t, std::uint32_t> kept;  // new index by old index
    std::vector<Frame> frames;
    for (std::size_t i = 0; i < out.size(); ++i) {
      if (out[i]) continue;
      kept.emplace(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(frames.size()));
      frames.push_back(std::move(dataset.frames[i]));
    }
    if (frames.empty())
      for (const Doubts& doubts : doubts_)
        if (!doubts.frames.empty()) throw Error("{}: {}", doubts.source, doubts.first);
    if (frames.size() < out.size())
      for (std::vector<std::uint32_t>& views : dataset.points.seen_by) renumber(views, kept);
    dataset.frames = std::move(frames);
  }

 private:
  std::array<Doubts, kinds> doubts_;
};

/// Warnings of one kind: the first line, and how often it holds.
struct CameraWarning {
  std::string first;
  std::size_t count = 0;
  void add(const std::string& line) {
    if (count++ == 0) first = line;
  }
};

bool is_outside(const Camera& camera) {
  return !(camera.cx > 0 && camera.cy > 0 && camera.cx < camera.width && camera.cy < camera.height);
}

// A principal point within the first pixel of a photograph is a fraction of its size.
bool is_normalised(const Camera& camera) {
  return camera.cx <= 1 && camera.cy <= 1 && std::min(camera.width, camera.height) >= 8;
}

std::string focal_problem(const Frame& frame) {
  const Camera& camera = frame.camera;
  const double longer = std::max(camera.width, camera.height), scale = double(frame.size.width) / camera.width;
  const double least = std::min(camera.fx, camera.fy), most = std::max(camera.fx, camera.fy);
  if (least >= 0.05 * longer && most <= 50 * longer && most * scale < 1e6) return {};
  const char* fix = least < 10              ? "; if it is a fraction of the width, multiply it by the width"
                    : least < 0.05 * longer ? "; if it is in millimetres, convert it to pixels"
                                            : "; run the reconstruction again";
  return fmt::format("the focal length of {}, {:.6g} pixels, is impossible for {} x {} pixels{}",
                     printable(frame.photograph.name), least < 0.05 * longer ? least : most, camera.width,
                     camera.height, fix);
}

/// A focal length that is possible, but hardly that of a photograph of a scene: a lens without fisheye that sees more
/// than 127 degrees, or less than 4.
std::string angle_doubt(const Frame& frame) {
  constexpr double kShortest = 0.25, kLongest = 15;  // longer sides
  const Camera& camera = frame.camera;
  const double sides = std::sqrt(camera.fx * camera.fy) / std::max(camera.width, camera.height);
  if (frame.lens.model != Lens::Model::perspective || (sides >= kShortest && sides <= kLongest)) return {};
  return fmt::format(
      "{}: the focal length of {}, {:.6g} pixels, is {:.2g} times the longer side of its photograph, which is {} for "
      "lenses; check the calibration, or find the poses again from the photographs alone",
      frame.source, printable(frame.photograph.name), camera.fx, sides, sides < 1 ? "too short" : "very long");
}

// Returns true if the frame is left out.
bool check_lens(const Frame& frame, std::size_t index, CameraDoubts& doubts, CameraWarning& folds) {
  const LensUse use = use_of(frame.camera, frame.lens);
  const std::string name = printable(frame.photograph.name);
  const std::string folding =
      fmt::format("the lens of {} ({}) folds over {:.0f} pixels from its principal point", name, frame.model, use.fold);
  if (use.lost > kMostLost) {
    doubts.add(CameraDoubts::fold, index, frame,
               fmt::format("{}, inside {:.0f} % of its picture; calibrate it again", folding, 100 * use.lost));
    return true;
  }
  if (use.shown < kLeastShown) {
    doubts.add(
        CameraDoubts::strong, index, frame,
        fmt::format("the distortion of {} ({}) is so strong that only {:.0f} % of its undistorted image shows the "
                    "photograph; calibrate it again",
                    name, frame.model, 100 * use.shown));
    return true;
  }
  if (use.lost > 0.02)
    folds.add(fmt::format("{}: {}; {:.0f} % of the photograph lies beyond and is masked", frame.source, folding,
                          100 * use.lost));
  return false;
}

}  // namespace

void check_intrinsics(Dataset& dataset) {
  CameraWarning middles, fields, folds, panoramas, ratios, angles;
  constexpr double kMaxRatio = 1.2;  // of focal lengths
  CameraDoubts doubts;
  for (std::size_t i = 0; i < dataset.frames.size(); ++i) {
    const Frame& frame = dataset.frames[i];
    const Camera& camera = frame.camera;
    const std::string name = printable(frame.photograph.name);
    const auto times = middle_of_another_size(camera);
    if (is_outside(camera)) {
      doubts.add(CameraDoubts::outside, i, frame,
                 fmt::format("the principal point ({:.6g}, {:.6g}) of {} lies outside its image of {} x {} pixels; {}",
                             camera.cx, camera.cy, name, camera.width, camera.height,
                             times ? likely_cause(camera, *times) : "correct cx and cy"));
      continue;
    }
    if (is_normalised(camera)) {
      doubts.add(
          CameraDoubts::normalised, i, frame,
          fmt::format("the intrinsics of {} are normalised (focal length {:.6g}, principal point {:.6g}, {:.6g}); "
                      "multiply those of x by the width and those of y by the height",
                      name, camera.fx, camera.cx, camera.cy));
      continue;
    }
    if (frame.lens.is_panorama()) {
      if (!is_whole_panorama(camera.width, camera.height))
        panoramas.add(
            fmt::format("{}: panorama {} of {} x {} pixels is not twice as wide as high, but is taken as 360 x "
                        "180 degrees",
                        frame.source, name, camera.width, camera.height));
      continue;
    }
    if (const std::string problem = focal_problem(frame); !problem.empty()) {
      doubts.add(CameraDoubts::focal_length, i, frame, problem);
      continue;
    }
    if (!frame.lens.is_pinhole() && check_lens(frame, i, doubts, folds)) continue;
    if (const double ratio = camera.fy / camera.fx;
        !frame.lens.is_panorama() && (ratio > kMaxRatio || ratio < 1 / kMaxRatio))
      ratios.add(
          fmt::format("{}: the focal lengths of {}, {:.6g} and {:.6g} pixels, differ by more than a fifth, as if "
                      "pixels were not square; calibrate the camera again",
                      frame.source, name, camera.fx, camera.fy));
    if (const std::string doubt = angle_doubt(frame); !doubt.empty()) angles.add(doubt);
    if (times)
      middles.add(fmt::format(
          "{}: the principal point ({:.6g}, {:.6g}) of {} is far from the centre of its {} x {} pixels; {}",
          frame.source, camera.cx, camera.cy, name, camera.width, camera.height, likely_cause(camera, *times)));
    else if (std::abs(frame.focal_times - 1) > 0.2)
      fields.add(fmt::format("{}: the focal length of {}, {:.6g} pixels, contradicts camera_angle_x; {}", frame.source,
                             name, camera.fx, likely_cause(camera, frame.focal_times)));
  }
  const std::size_t all = dataset.frames.size();
  doubts.leave_out(dataset);
  for (const CameraWarning& warning : {middles, fields, folds, panoramas, ratios, angles})
    if (warning.count > 0)
      dataset.findings.warn(fmt::format("{} ({} of {} photographs)", warning.first, warning.count, all));
}

}  // namespace trisoup::scene
