#include "scene/formats/pose.h"

#include <algorithm>
#include <cmath>

#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

constexpr double largest_coordinate = 1e18;
constexpr double rotation_tolerance = 1e-2;

double distance_from_rotation(const glm::dmat3& matrix) {
  const glm::dmat3 difference = glm::transpose(matrix) * matrix - glm::dmat3(1.0);
  double largest = 0;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) largest = std::max(largest, std::abs(difference[column][row]));
  return largest;
}

// Newton's iteration for the polar decomposition. Within the tolerance it converges in three or four iterations.
glm::dmat3 nearest_rotation(glm::dmat3 matrix) {
  for (int i = 0; i < 6; ++i) matrix = 0.5 * (matrix + glm::transpose(glm::inverse(matrix)));
  return matrix;
}

}  // namespace

bool is_usable(const glm::dvec3& position) {
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(position[i]) <= largest_coordinate)) return false;
  return true;
}

glm::dmat4 from_opengl_pose(const std::array<double, 16>& m, const std::string& where) {
  for (const double value : m)
    if (!std::isfinite(value))
      throw RecordError(where, "pose is not finite; remove the frame or estimate its pose again");
  const glm::dvec3 centre(m[3], m[7], m[11]);
  if (!is_usable(centre))
    throw RecordError(where, "camera is farther than 1e18 units from the origin; correct its pose");
  if (std::abs(m[12]) + std::abs(m[13]) + std::abs(m[14]) + std::abs(m[15] - 1) > 1e-6)
    throw RecordError(where, "last row of the pose is not 0 0 0 1; write a row-major camera-to-world matrix");

  const glm::dmat3 axes(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]);
  const double off = distance_from_rotation(axes);
  const bool turned = off <= rotation_tolerance;  // false for NaN from an overflow
  if (!turned || glm::determinant(axes) <= 0) {
    const char* problem = "pose is not a rotation and a translation{}; export it without scale, shear or mirroring";
    const std::string size = turned ? ": it mirrors" : fmt::format(" (off by {:.2g})", off);
    throw RecordError(where, fmt::format(fmt::runtime(problem), turned ? ": it mirrors" : ""),
                      fmt::format(fmt::runtime(problem), size));
  }
  glm::dmat3 rotation = nearest_rotation(axes);
  rotation[1] = -rotation[1];  // y up, z backward -> y down, z forward
  rotation[2] = -rotation[2];

  const glm::dmat3 world_to_camera = glm::transpose(rotation);
  glm::dmat4 result(world_to_camera);
  result[3] = glm::dvec4(-(world_to_camera * centre), 1.0);
  return result;
}

glm::dmat4 from_colmap_pose(const std::array<double, 4>& quaternion, const glm::dvec3& translation,
                            const std::string& where) {
  double largest = 0;
  for (const double value : quaternion) {
    if (!std::isfinite(value))
      throw RecordError(where, "pose is not finite; remove the image or estimate its pose again");
    largest = std::max(largest, std::abs(value));
  }
  if (!is_usable(translation))
    throw RecordError(where, "translation is not finite or beyond 1e18; remove the image or estimate its pose again");
  if (largest == 0) throw RecordError(where, "quaternion is zero; remove the image or estimate its pose again");

  // Divides by the largest component first, so that the squares neither overflow nor underflow.
  double q[4], squares = 0;
  for (int i = 0; i < 4; ++i) q[i] = quaternion[std::size_t(i)] / largest, squares += q[i] * q[i];
  const double length = std::sqrt(squares), w = q[0] / length, x = q[1] / length, y = q[2] / length, z = q[3] / length;
  const glm::dmat3 rotation(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),   // first column
                            2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),   // second
                            2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));  // third
  glm::dmat4 result(rotation);
  result[3] = glm::dvec4(translation, 1.0);
  return result;
}

}  // namespace trisoup::scene
