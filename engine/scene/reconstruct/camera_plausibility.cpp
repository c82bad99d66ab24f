#include "scene/reconstruct/camera_plausibility.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace trisoup::scene {
namespace {

constexpr double kMostAnamorphic = 0.05;             // relative difference of fx and fy
constexpr double kShortest = 0.3, kLongest = 4;      // focal length, in longer sides
constexpr double kMostOffCentre = 0.1;               // distance of the principal point from the centre, in sides
constexpr double kLeastScale = 0.4, kMostScale = 2;  // of the corners' radius by distortion, of perspective lenses

/// Distance from the principal point to the farthest corner, on the distorted image plane at depth 1.
double farthest_corner(const Camera& camera) {
  return std::hypot(std::max(camera.cx, camera.width - camera.cx) / camera.fx,
                    std::max(camera.cy, camera.height - camera.cy) / camera.fy);
}

bool is_off_centre(const Camera& camera) {
  return std::abs(camera.cx / camera.width - 0.5) > kMostOffCentre ||
         std::abs(camera.cy / camera.height - 0.5) > kMostOffCentre;
}

}  // namespace

std::string implausibility(const Camera& camera, const Lens& lens, double exif_focal) {
  const double least = std::min(camera.fx, camera.fy), most = std::max(camera.fx, camera.fy);
  const double focal = std::sqrt(least * most), longer = std::max(camera.width, camera.height);
  // The negated conditions hold for NaN too.
  if (!(most <= (1 + kMostAnamorphic) * least))
    return fmt::format("focal lengths of {:.0f} and {:.0f} pixels, but pixels are square", camera.fx, camera.fy);
  if (exif_focal > 0 && !(std::abs(focal / exif_focal - 1) <= kMostOffExif))
    return fmt::format("focal length of {:.0f} pixels, but EXIF says {:.0f}", focal, exif_focal);
  if (!(focal >= kShortest * longer && focal <= kLongest * longer))
    return fmt::format("focal length of {:.0f} pixels for a photograph of {} x {}", focal, camera.width, camera.height);
  if (is_off_centre(camera))
    return fmt::format("principal point ({:.0f}, {:.0f}) of a photograph of {} x {}", camera.cx, camera.cy,
                       camera.width, camera.height);
  const double corner = farthest_corner(camera);
  if (const auto fold = lens.folds_at(); fold && !(*fold > corner))
    return fmt::format("distortion that folds over {:.0f} pixels from the principal point", *fold * focal);
  const double scale = lens.distort_radius(corner) / corner;
  if (lens.model == Lens::Model::perspective && !(scale > kLeastScale && scale < kMostScale))
    return fmt::format("distortion that moves the corners to {:.2g} times their distance", scale);
  return {};
}

}  // namespace trisoup::scene
