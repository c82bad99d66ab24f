// The pinhole camera of views, and its projection to clip space.
#pragma once

#include <optional>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Pinhole camera. Axes as in OpenCV: x right, y down, z forward. Pixel (i, j) covers [i, i+1) x [j, j+1), so its
/// centre is (i + 0.5, j + 0.5). Row 0 is the top of the image.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  glm::dmat4 world_to_camera{1.0};        // rotation and translation of column vectors (x, y, z, 1)

  glm::dvec3 centre() const;   // position of the camera in world space
  glm::dvec3 forward() const;  // unit viewing direction in world space
};

/// Where a camera shows a point.
struct Shown {
  glm::dvec2 pixel;  // in [0, width) x [0, height)
  double depth;      // along the viewing direction, above 0
};
/// Returns nullopt if the point is behind the camera or outside its image. point: world space.
std::optional<Shown> shown_at(const Camera& camera, const glm::dvec3& point);

/// Returns the camera for an image of another size: intrinsics are scaled per axis by the ratio of the sizes, so that
/// the image shows the same rays. Sizes in pixels, positive.
Camera resized(const Camera& camera, int width, int height);

/// Returns the projection of world space (column vectors) to OpenGL-style clip space: z / w is -1 at depth `near` and 1
/// at depth `far`, and w is the depth along the viewing direction. NDC y points down, like the rows of the image: the
/// centre of row j of H is at y = -1 + 2 (j + 0.5) / H, and row 0 is the top. near and far: units of world space, 0 <
/// near < far.
glm::dmat4 clip_from_world(const Camera& camera, double near, double far);

/// Directions from a surface to the camera, linear in NDC: centre + ndc.x * x + ndc.y * y. Not normalised. All depths
/// of a pixel have the same direction.
struct PixelRays {
  glm::dvec3 centre, x, y;
};

/// world_from_clip: inverse of clip_from_world() of a pinhole camera. For such a matrix, w of the unprojected near and
/// far points does not depend on NDC x and y, so the ray from far to near is linear in x and y.
PixelRays pixel_rays(const glm::dmat4& world_from_clip);

/// Returns the position of that camera in world space, where its rays meet.
glm::dvec3 eye(const glm::dmat4& world_from_clip);

}  // namespace trisoup::scene
