// The triangles that a run starts from, by Settings::init.
#pragma once

#include <vector>

#include <glm/glm.hpp>

#include "scene/scene.h"
#include "train/settings.h"

namespace trisoup::train {

/// 3 vertices per triangle in normalised coordinates. Throws Error when the scene has no points to start from, or the mesh file
/// cannot be used.
std::vector<glm::vec3> initial_triangles(const scene::Scene& scene, const Settings& settings);

}  // namespace trisoup::train
