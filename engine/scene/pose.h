// Camera poses as files write them, checked and brought to Camera::world_to_camera.
#pragma once

#include <array>
#include <string>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// True if every component can be computed with: finite, and small enough to be squared in single precision.
bool is_usable(const glm::dvec3& position);

/// From the camera-to-world matrix of Blender, NeRF and nerfstudio files: 4 x 4, row-major, column vectors, OpenGL
/// camera axes (x right, y up, z backward). The rotation may be off by up to 1e-2 and is then replaced by the nearest
/// one. Throws Error, naming `where` (file and frame), if it is farther off, mirrors, or is not finite.
glm::dmat4 from_opengl_pose(const std::array<double, 16>& camera_to_world, const std::string& where);

/// From COLMAP's world-to-camera pose: quaternion (w, x, y, z) of any length but zero, and translation; OpenCV camera
/// axes. Throws Error, naming `where` (file and image), if it is not finite or the quaternion is zero.
glm::dmat4 from_colmap_pose(const std::array<double, 4>& quaternion, const glm::dvec3& translation,
                            const std::string& where);

}  // namespace trisoup::scene
