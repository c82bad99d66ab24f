// The background on which photographs with alpha are composited.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::scene {

enum class BackgroundChoice { automatic, white, grey, black };  // automatic: white if images have alpha, else black

/// Names of the choices: auto, white, grey and black.
const std::vector<std::string>& background_names();
const std::string& name_of(BackgroundChoice choice);
/// The choice with this name; automatic if there is none.
BackgroundChoice background_named(std::string_view name);
/// The choice, other than automatic, that is nearest to a colour, 0..1.
BackgroundChoice nearest_background(const glm::vec3& colour);
/// Grey level of a choice.
std::uint8_t grey_level(BackgroundChoice choice, bool any_alpha);

}  // namespace trisoup::scene
