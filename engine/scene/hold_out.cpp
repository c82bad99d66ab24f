#include "scene/hold_out.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.h"

namespace trisoup::scene {

std::size_t usual_validation_views(const Scene& scene) {
  const std::size_t views = scene.train.size();
  return std::clamp<std::size_t>(
      std::min(std::clamp<std::size_t>(views / 10, 3, 24), (std::max<std::size_t>(views, 1) - 1) / 2), 1, 24);
}

void hold_out(Scene& scene, std::size_t count) {
  const std::size_t views = scene.train.size();
  if (2 * count >= views)
    throw Error(
        "{}: {} training views are too few to hold out {} for validation; lower `validation_views`, or train without a "
        "goal",
        scene.path.string(), views, count);
  std::vector<bool> held(views);
  for (std::size_t i = 0; i < count; ++i) held[(2 * i + 1) * views / (2 * count)] = true;
  std::vector<std::optional<std::uint32_t>> now(views);  // new index of the remaining views
  std::vector<View> train;
  for (std::size_t v = 0; v < views; ++v) {
    if (!held[v]) now[v] = static_cast<std::uint32_t>(train.size());
    (held[v] ? scene.validation : train).push_back(std::move(scene.train[v]));
  }
  scene.train = std::move(train);
  for (std::vector<std::uint32_t>& seen : scene.points.seen_by) {
    std::vector<std::uint32_t> left;
    for (const std::uint32_t v : seen)
      if (now[v]) left.push_back(*now[v]);
    seen = std::move(left);
  }
}

}  // namespace trisoup::scene
