#include "train/step/neighbour_eyes.h"

#include <limits>

#include "soup/random.h"

namespace trisoup::train {

std::vector<Neighbours> nearest_eyes(std::span<const BatchView> views) {
  // Eyes of one camera that only turned, such as the faces of a panorama; normalised units.
  constexpr double kSamePlace = 1e-6;
  std::vector<glm::dvec3> eyes;
  for (const BatchView& view : views) eyes.push_back(scene::eye(view.world_from_clip));
  std::vector<Neighbours> all;
  for (std::uint32_t i = 0; i < eyes.size(); ++i) {
    Neighbours found{i, i};
    std::array<double, 2> distances{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (std::uint32_t other = 0; other < eyes.size(); ++other) {
      const double distance = glm::distance(eyes[i], eyes[other]);
      if (distance <= kSamePlace) continue;
      if (distance < distances[0]) {
        found = {other, found[0]};
        distances = {distance, distances[0]};
      } else if (distance < distances[1]) {
        found[1] = other;
        distances[1] = distance;
      }
    }
    all.push_back(found);
  }
  return all;
}

std::uint32_t seen_from(std::uint64_t seed, std::uint64_t step, std::uint32_t view, const Neighbours& neighbours,
                        double share) {
  if (share <= 0) return view;
  constexpr std::uint64_t kStream = 0x65796573;  // "eyes"
  soup::Random random(seed ^ (kStream << 24), step);
  random.seek(std::uint64_t(view) * 2);
  if (random.uniform01() >= share) return view;
  return neighbours[random.uniform01() < 0.5 ? 0 : 1];
}

}  // namespace trisoup::train
