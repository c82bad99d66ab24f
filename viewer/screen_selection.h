// Which triangles lie under a brush or inside an outline on the screen.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "scene/camera.h"
#include "soup/soup.h"

namespace trisoup::viewer {

/// The visible triangle of every pixel: its number + 1, or 0 for none. Rows from the top.
struct TrianglePicture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> hits;  // [height][width]
};

/// What a round brush covers that moved in a straight line. Pixels.
struct BrushMove {
  glm::dvec2 from{0.0}, to{0.0};
  double radius = 1;
};

/// Returns the triangle that `at`, pixels, shows, + 1; 0 if there is none.
std::uint32_t hit_at(const TrianglePicture& picture, const glm::dvec2& at);

/// Returns the triangles that are visible at the centre of a pixel under the brush, ascending.
std::vector<std::uint32_t> visible_under(const TrianglePicture& picture, const BrushMove& brush);

/// Returns the triangles of which at least half of the visible pixels are inside the outline, ascending: a wall behind
/// an object is not selected with it. outline: corners of a closed polygon, pixels; where it crosses itself, the
/// even-odd rule holds.
std::vector<std::uint32_t> visible_inside(const TrianglePicture& picture, std::span<const glm::dvec2> outline);

/// Returns the triangles that the brush touches, hidden ones too, ascending. Parts closer than `near`, normalised units
/// along the viewing axis, do not count. camera: normalised coordinates, in the pixels of the brush.
std::vector<std::uint32_t> all_under(const soup::Model& model, const scene::Camera& camera, double near,
                                     const BrushMove& brush);

/// Returns the triangles whose centroid appears inside the outline, hidden ones too, ascending. The other arguments are
/// as in all_under().
std::vector<std::uint32_t> all_inside(const soup::Model& model, const scene::Camera& camera, double near,
                                      std::span<const glm::dvec2> outline);

}  // namespace trisoup::viewer
