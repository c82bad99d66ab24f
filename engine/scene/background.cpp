#include "scene/background.h"

#include <algorithm>

namespace trisoup::scene {

const std::vector<std::string>& background_names() {
  static const std::vector<std::string> names{"auto", "white", "grey", "black"};  // in the order of BackgroundChoice
  return names;
}

const std::string& name_of(BackgroundChoice choice) { return background_names().at(static_cast<std::size_t>(choice)); }

BackgroundChoice background_named(std::string_view name) {
  const auto& names = background_names();
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? BackgroundChoice::automatic
                              : static_cast<BackgroundChoice>(std::distance(names.begin(), found));
}

BackgroundChoice nearest_background(const glm::vec3& colour) {
  const float grey = (colour.r + colour.g + colour.b) / 3.0f;
  return grey > 0.75f ? BackgroundChoice::white : grey > 0.25f ? BackgroundChoice::grey : BackgroundChoice::black;
}

std::uint8_t grey_level(BackgroundChoice choice, bool any_alpha) {
  switch (choice) {
    case BackgroundChoice::white:
      return 255;
    case BackgroundChoice::grey:
      return 128;
    case BackgroundChoice::black:
      return 0;
    case BackgroundChoice::automatic:
      break;
  }
  return any_alpha ? 255 : 0;
}

}  // namespace trisoup::scene
