// The pinhole camera every view is brought to, and its projection to clip space.
#pragma once

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Pinhole camera. OpenCV axes: x right, y down, z forward. Pixel (i, j) covers [i, i+1) x [j, j+1), so its centre is
/// (i + 0.5, j + 0.5) and row 0 is the top of the image.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  glm::dmat4 world_to_camera{1.0};        // rigid: rotation and translation, maps column vectors (x, y, z, 1)

  glm::dvec3 centre() const;   // position of the camera in world space
  glm::dvec3 forward() const;  // unit viewing direction in world space
};

/// The same camera for an image of another size: intrinsics are scaled per axis by the ratio of the sizes, so that
/// every ray keeps its direction. Sizes in pixels, positive.
Camera resized(const Camera& camera, int width, int height);

/// Projection of world space (column vectors) to OpenGL-style clip space: z / w runs from -1 at depth `near` to 1 at
/// depth `far`, w is the depth along the viewing direction. NDC y grows downwards, like the rows of the image: row j of
/// H has its centre at y = -1 + 2 (j + 0.5) / H, and row 0 is the top. Distances are in units of the world space, 0 <
/// near < far.
glm::dmat4 clip_from_world(const Camera& camera, double near, double far);

/// Directions from the surface towards the camera, linear in NDC: centre + ndc.x * x + ndc.y * y, not normalised; the
/// same for every depth of a pixel.
struct PixelRays {
  glm::dvec3 centre, x, y;
};

/// world_from_clip: inverse of a clip_from_world of a pinhole camera. The ray from far to near through NDC (x, y) is
/// linear in x and y there: w of the unprojected near and far points does not depend on them.
PixelRays pixel_rays(const glm::dmat4& world_from_clip);

/// Where the rays of that camera meet.
glm::dvec3 eye(const glm::dmat4& world_from_clip);

}  // namespace trisoup::scene
