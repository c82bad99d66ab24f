// Cameras drawn as pyramids: the eye, and a picture in front of it.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "format/model_file.h"
#include "scene/camera.h"

namespace trisoup::viewer {

/// A line on the screen, pixels.
using Line = std::array<glm::dvec2, 2>;

/// Returns what `viewer` sees of the line between two points, normalised units; nullopt if all of it is closer along
/// its axis than `near`, above 0. What is closer is cut off.
std::optional<Line> line_on_screen(const glm::dvec3& from, const glm::dvec3& to, double near,
                                   const scene::Camera& viewer);

/// Returns the edges of a camera's pyramid as `viewer` sees them. length: from its eye to its picture, normalised
/// units. Parts behind the viewer are cut off. Empty if the two eyes are closer than `length`: the pyramid would cover
/// the window.
std::vector<Line> frustum_lines(const scene::Camera& camera, double length, const scene::Camera& viewer);

/// Returns the index of the camera whose pyramid covers `at` or has an edge at most `reach` pixels away; of several,
/// the one closest to the viewer.
std::optional<std::size_t> frustum_at(std::span<const soup::ModelCamera> cameras, double length,
                                      const scene::Camera& viewer, const glm::dvec2& at, double reach);

/// Returns the index of the camera whose view is most like that of `viewer`: the smallest sum of the angle between
/// their directions, radians, and the distance of their eyes in units of `distance`, from the viewer's eye to what it
/// looks at. Nullopt if there are no cameras.
std::optional<std::size_t> nearest_camera(std::span<const soup::ModelCamera> cameras, const scene::Camera& viewer,
                                          double distance);

}  // namespace trisoup::viewer
