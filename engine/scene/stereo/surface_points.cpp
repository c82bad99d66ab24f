#include "scene/stereo/surface_points.h"

#include <cstdlib>
#include "scene/points_from_views.h"
#include "scene/stereo/dense_points.h"
#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

Points surface_points(gpu::Device& gpu, std::span<const View> views, const Points& points,
                      const std::function<void(int done, int total)>& progress) {
  DepthMapOptions options;
  options.progress = progress;
  if (const char* t = std::getenv("TS_PIX")) options.pixels = std::size_t(std::atoi(t));
  if (const char* t = std::getenv("TS_MIN"))
    options.shortest_long_side = std::atoi(t), options.longest_side = std::atoi(t);
  const std::vector<DepthMap> maps = depth_maps(gpu, views, points, options);
  Points dense = dense_points(views, maps);
  if (dense.positions.size() < kFewestPoints) return points.positions.empty() ? points_from_views(views) : points;
  if (std::getenv("TS_DENSE")) return dense;
  if (std::getenv("TS_PLAIN")) {
    Points q = points;
    for (std::size_t i = 0; i < dense.positions.size(); ++i) {
      q.positions.push_back(dense.positions[i]);
      q.colours.push_back(dense.colours[i]);
      q.seen_by.push_back(dense.seen_by[i]);
      if (!q.errors.empty()) q.errors.push_back(-1);
    }
    return q;
  }
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
