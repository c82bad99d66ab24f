// A start from a closed surface that covers everything that the photographs show, with their colours.
#pragma once

#include "scene/scene.h"
#include "train/config/settings.h"
#include "train/start/initial_triangles.h"

namespace trisoup::train {

/// Builds a surface from the sparse points and their sightings (soup::surface_from_sightings) and from points on a
/// sphere around them, which close it. Decimates it for the training views, so that surface and backdrop
/// (settings.backdrop) together have at most settings.triangles triangles. Throws Error if the scene has no points.
Start surface_start(const scene::Scene& scene, const Settings& settings);

/// A sphere of 80 triangles around the origin, 3 vertices each.
std::vector<glm::vec3> backdrop_triangles(double radius);

}  // namespace trisoup::train
