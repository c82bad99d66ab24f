// Finds the point of the surface under a pixel.
#pragma once

#include <optional>

#include <glm/glm.hpp>

#include "scene/camera.h"
#include "soup/soup.h"

namespace trisoup::viewer {

/// Returns the nearest point, normalised coordinates, where the ray through `pixel` meets a triangle whose opacity
/// there is at least 0.5. Only depths from `near` to `far` count. drop_behind: triangles that reach behind the camera
/// do not count, as in render::DrawOptions. Returns nullopt if there is none.
std::optional<glm::dvec3> surface_point(const soup::Model& model, const scene::Camera& camera, const glm::dvec2& pixel,
                                        double near, double far, bool drop_behind);

}  // namespace trisoup::viewer
