// The triangles that a run starts from, by Settings::init.
#pragma once

#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

struct Start {
  std::vector<glm::vec3> vertices;  // 3 per triangle, normalised coordinates
  std::vector<glm::vec3> colours;   // of the vertices, 0..1; empty: not known
  std::size_t opaque = 0;           // the last so many triangles are opaque, and stay so
  Start() = default;
  Start(std::vector<glm::vec3> triangles) : vertices(std::move(triangles)) {}
};

/// Throws Error when the scene has no points to start from, or the mesh file cannot be used.
Start initial_triangles(const scene::Scene& scene, const Settings& settings);

}  // namespace trisoup::train
