#include "scene/point_cloud.h"

#include <algorithm>
#include <utility>

namespace trisoup::scene {

void PointCloud::add(const glm::dvec3& position, const glm::u8vec3& colour, double error,
                     std::vector<std::uint32_t> track) {
  std::sort(track.begin(), track.end());
  track.erase(std::unique(track.begin(), track.end()), track.end());
  positions.push_back(position);
  colours.push_back(colour);
  errors.push_back(error >= 0 && error < 1e6 ? static_cast<float>(error) : -1.0f);
  seen_by.push_back(std::move(track));
}

void drop_empty_tracks(PointCloud& cloud) {
  const auto is_empty = [](const std::vector<std::uint32_t>& views) { return views.empty(); };
  if (std::all_of(cloud.seen_by.begin(), cloud.seen_by.end(), is_empty)) cloud.seen_by.clear();
}

void renumber(std::vector<std::uint32_t>& views, const std::map<std::uint32_t, std::uint32_t>& to) {
  std::vector<std::uint32_t> renumbered;
  for (const std::uint32_t view : views)
    if (const auto found = to.find(view); found != to.end()) renumbered.push_back(found->second);
  std::sort(renumbered.begin(), renumbered.end());
  views = std::move(renumbered);
}

}  // namespace trisoup::scene
