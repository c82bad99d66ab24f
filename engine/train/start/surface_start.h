// A start that covers all that the photographs show, in their colours.
#pragma once

#include "scene/scene.h"
#include "train/config/settings.h"
#include "train/start/initial_triangles.h"

namespace trisoup::train {

/// The surface that the sparse points and their sightings tell (soup::surface_from_sightings), closed by a sphere
/// beyond them all, of at most settings.triangles triangles, as fine as the cameras see it, before a backdrop
/// (settings.backdrop). Throws Error where the scene has no points.
Start surface_start(const scene::Scene& scene, const Settings& settings);

/// A sphere of 80 triangles around the origin.
std::vector<glm::vec3> backdrop_triangles(double radius);

}  // namespace trisoup::train
