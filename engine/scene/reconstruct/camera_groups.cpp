#include "scene/reconstruct/camera_groups.h"

#include <algorithm>
#include <tuple>

namespace trisoup::scene {

std::vector<std::vector<std::string>> camera_groups(std::span<const PhotographFacts> photographs) {
  constexpr double kZoom = 1.03;
  std::vector<const PhotographFacts*> order;
  for (const PhotographFacts& facts : photographs) order.push_back(&facts);
  std::stable_sort(order.begin(), order.end(), [](const PhotographFacts* a, const PhotographFacts* b) {
    return std::tuple(a->width, a->height, a->focal_length) < std::tuple(b->width, b->height, b->focal_length);
  });
  // Within a group, photographs keep the order given: neighbours in a list may be compared only with each other.
  std::vector<std::vector<const PhotographFacts*>> groups;
  for (const PhotographFacts* facts : order) {
    const PhotographFacts* first = groups.empty() ? nullptr : groups.back().front();
    if (first == nullptr || first->width != facts->width || first->height != facts->height ||
        facts->focal_length > kZoom * first->focal_length)
      groups.emplace_back();
    groups.back().push_back(facts);
  }
  std::vector<std::vector<std::string>> names;
  for (auto& group : groups) {
    std::sort(group.begin(), group.end());  // pointers into one array
    names.emplace_back();
    for (const PhotographFacts* facts : group) names.back().push_back(facts->name);
  }
  return names;
}

}  // namespace trisoup::scene
