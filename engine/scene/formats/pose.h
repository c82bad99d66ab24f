// Checks camera poses from files and converts them to Camera::world_to_camera.
#pragma once

#include <array>
#include <string>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Returns true if every component is finite and its square fits in single precision.
bool is_usable(const glm::dvec3& position);

/// Converts the camera-to-world matrix of Blender, NeRF and nerfstudio files: 4 x 4, row-major, for column vectors,
/// OpenGL camera axes (x right, y up, z backward). An error of the rotation of up to 1e-2 is corrected to the nearest
/// rotation. Throws RecordError that begins with `where` (file and frame) if the error is larger or if the matrix
/// mirrors or is not finite.
glm::dmat4 from_opengl_pose(const std::array<double, 16>& camera_to_world, const std::string& where);

/// Converts COLMAP's world-to-camera pose: quaternion (w, x, y, z) of any length except zero, and translation; OpenCV
/// camera axes. Throws RecordError that begins with `where` (file and image) if a value is not finite or the quaternion
/// is zero.
glm::dmat4 from_colmap_pose(const std::array<double, 4>& quaternion, const glm::dvec3& translation,
                            const std::string& where);

}  // namespace trisoup::scene
