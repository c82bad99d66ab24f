#include "scene/stereo/surface_points.h"

#include <algorithm>
#include <vector>

#include "scene/points_from_views.h"
#include "scene/stereo/dense_points.h"
#include "scene/stereo/depth_maps.h"
#include "scene/stereo/distant_points.h"
#include "scene/stereo/measured_planes.h"

namespace trisoup::scene {

namespace {

/// Pixels of the small pictures for each step of the training, at least, and as a share of a photograph's: stereo then
/// takes about as long as the steps. Below kFewestSteps there are too few pictures to compare.
constexpr double kPixelsPerStep = 3200, kSharePerStep = 0.025;
constexpr std::uint64_t kFewestSteps = 100;
constexpr float kUnknownError = -1;
constexpr std::size_t kMeasuredPixels = 400'000;  // of measured depth maps at least; they cost no comparison

double mean_pixels(std::span<const View> views) {
  double sum = 0;
  for (const View& view : views) sum += static_cast<double>(view.image.rgba.size() / 4);
  return sum / static_cast<double>(std::max<std::size_t>(1, views.size()));
}

}  // namespace

Points surface_points(gpu::Device& gpu, std::span<const View> views, const Points& points, std::uint64_t steps,
                      const std::function<void(int done, int total)>& progress) {
  DepthMapOptions options;
  options.progress = progress;
  const double per_step = std::max(kPixelsPerStep, kSharePerStep * mean_pixels(views));
  options.pixels = std::min(options.pixels, static_cast<std::size_t>(static_cast<double>(steps) * per_step));
  std::vector<DepthMap> maps;
  if (steps >= kFewestSteps) maps = depth_maps(gpu, views, points, options);
  add_measured_planes(views, std::max(options.pixels, kMeasuredPixels), maps);
  Points result = dense_points(maps);
  if (result.positions.size() < kFewestPoints) return points.positions.empty() ? points_from_views(views) : points;
  const auto append = [&](const Points& more) {
    result.positions.insert(result.positions.end(), more.positions.begin(), more.positions.end());
    result.seen_by.insert(result.seen_by.end(), more.seen_by.begin(), more.seen_by.end());
    result.errors.insert(result.errors.end(), more.errors.begin(), more.errors.end());
    result.errors.resize(result.positions.size(), kUnknownError);
  };
  result.errors.resize(result.positions.size(), kUnknownError);
  append(checked_sightings(points, maps));
  const Points distant = distant_points(maps);
  append(distant);
  result.distant = distant.distant;
  result.measured.resize(result.positions.size());
  result.stereo = true;
  return result;
}

}  // namespace trisoup::scene
