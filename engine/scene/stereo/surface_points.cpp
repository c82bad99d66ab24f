#include "scene/stereo/surface_points.h"

#include <algorithm>
#include <vector>

#include "scene/points_from_views.h"
#include "scene/stereo/dense_points.h"
#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

namespace {

/// Pixels of the small pictures for each step of the training. Below kFewestSteps there are too few pictures to
/// compare.
constexpr std::uint64_t kPixelsPerStep = 3200, kFewestSteps = 100;

}  // namespace

Points surface_points(gpu::Device& gpu, std::span<const View> views, const Points& points, std::uint64_t steps,
                      const std::function<void(int done, int total)>& progress) {
  DepthMapOptions options;
  options.progress = progress;
  options.pixels = static_cast<std::size_t>(std::min<std::uint64_t>(options.pixels, steps * kPixelsPerStep));
  std::vector<DepthMap> maps;
  if (steps >= kFewestSteps) maps = depth_maps(gpu, views, points, options);
  Points dense = dense_points(views, maps);
  if (dense.positions.size() < kFewestPoints) return points.positions.empty() ? points_from_views(views) : points;
  const Points checked = checked_sightings(points, maps);
  if (!checked.errors.empty()) dense.errors.resize(dense.positions.size(), -1.0f);
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(dense.positions, checked.positions);
  append(dense.errors, checked.errors);
  append(dense.seen_by, checked.seen_by);
  if (checked.colours.size() == checked.positions.size())
    append(dense.colours, checked.colours);
  else
    dense.colours.clear();
  return dense;
}

}  // namespace trisoup::scene
