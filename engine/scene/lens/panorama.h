// Panoramas: photographs of all directions, which are read as six pinhole images each.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include <glm/glm.hpp>

#include "scene/camera.h"
#include "scene/lens/photograph.h"

namespace trisoup::scene {

/// The camera of a panorama: longitude = (x - cx) / fx and latitude = (y - cy) / fy in radians. The middle of the image
/// looks forward (z), longitudes grow to the right (x), latitudes grow downward (y). This is COLMAP's EQUIRECTANGULAR,
/// nerfstudio's EQUIRECTANGULAR and instant-ngp's latlong. width, height: pixels of 360 x 180 degrees.
Camera panorama_camera(int width, int height);

/// Returns whether an image is twice as wide as high, as panoramas of 360 x 180 degrees with square pixels are.
bool is_whole_panorama(int width, int height);

/// A face of a cube around the camera, seen from inside with a field of view of 90 degrees.
struct CubeFace {
  std::string_view name;
  glm::dmat3 panorama_from_face;  // rotation between camera axes
};

/// The six faces, in the order of their names. Front looks along the panorama's z, right along its x, down along its y.
const std::array<CubeFace, 6>& cube_faces();

/// Returns the index of the face that sees a direction in the camera axes of the panorama.
std::size_t face_towards(glm::dvec3 direction);

/// Returns the side of the faces in pixels for a panorama of `width` pixels: a quarter, so that the four faces around
/// the horizon have as many pixels as the panorama.
int face_side(int width);

/// Returns the pinhole camera of a face. panorama: with the size of the photograph, and its pose.
Camera face_camera(const Camera& panorama, std::size_t face);

/// Returns the photograph that face_camera() would take, sampled bilinearly across the left and right border. panorama:
/// camera of the photograph, with the same size; its pose is not used.
Photograph cut_face(const Photograph& photograph, const Camera& panorama, std::size_t face);

}  // namespace trisoup::scene
