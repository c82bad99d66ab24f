// The initial triangles of a training, by Settings::init.
#pragma once

#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

struct Start {
  std::vector<glm::vec3> vertices;  // 3 per triangle, normalised coordinates
  std::vector<glm::vec3> colours;   // of the vertices, 0..1; empty: unknown
  std::size_t opaque = 0;           // number of triangles, the last ones, whose opacity is fixed to 1
  Start() = default;
  Start(std::vector<glm::vec3> triangles) : vertices(std::move(triangles)) {}
};

/// Makes the number of a start's triangles the budget, if the surface decides on it.
void take_budget(Settings& settings, const Start& start);

/// Throws Error if the start needs points and the scene has none, or if the mesh file cannot be used.
Start initial_triangles(const scene::Scene& scene, const Settings& settings);

}  // namespace trisoup::train
