// What a model's colours become in photographs of another camera. A capture with two cameras has two exposures, and
// the model has their mean: its test views are compared as the cameras that took them show its colours.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "scene/scene.h"
#include "soup/soup.h"

namespace trisoup::train {

/// The mean exposures of the training photographs of each camera, shrunk by what photographs of one camera differ among
/// themselves. Views are of one camera if folder and proportions are the same, and the angle of view within 10 %. Empty
/// if there is only one camera. exposures: as of Trainer::exposures(), a pair for each view; empty: identity.
std::vector<soup::CameraExposure> camera_exposures(const std::vector<scene::View>& views,
                                                   std::span<const glm::vec4> exposures);

/// Applies an exposure to a picture, but to its background. colour: [height][width][3], 0..1.
void expose(std::vector<float>& colour, const soup::CameraExposure& exposure, const glm::vec3& background);

/// The exposure of the camera that has taken a view; null if it is none of these.
const soup::CameraExposure* exposure_of(const scene::View& view, std::span<const soup::CameraExposure> cameras);

}  // namespace trisoup::train
