#include "scene/pose_change.h"

#include <array>
#include <cmath>

#include "base/small_system.h"

namespace trisoup::scene {
namespace {

/// Rodrigues' formula.
glm::dmat3 rotation_of(const glm::dvec3& turn) {
  const double angle = glm::length(turn);
  if (angle == 0) return glm::dmat3(1.0);
  const glm::dvec3 axis = turn / angle;
  const glm::dmat3 cross(glm::dvec3(0, axis.z, -axis.y), glm::dvec3(-axis.z, 0, axis.x),
                         glm::dvec3(axis.y, -axis.x, 0));
  return glm::dmat3(1.0) + std::sin(angle) * cross + (1 - std::cos(angle)) * cross * cross;
}

/// Turn and shift of all cameras by a common transform: turn about the world's origin, shift, growth.
constexpr std::size_t kCommon = 7;

/// Rows of d(turn, shift) / d(common transform) for a camera at `centre`.
std::array<std::array<double, kCommon>, 6> rows_at(const glm::dvec3& c) {
  return {{{1, 0, 0, 0, 0, 0, 0},
           {0, 1, 0, 0, 0, 0, 0},
           {0, 0, 1, 0, 0, 0, 0},
           {0, c.z, -c.y, 1, 0, 0, c.x},
           {-c.z, 0, c.x, 0, 1, 0, c.y},
           {c.y, -c.x, 0, 0, 0, 1, c.z}}};
}

}  // namespace

Camera changed(const Camera& camera, const PoseChange& change) {
  if (change.turn == glm::dvec3(0.0) && change.shift == glm::dvec3(0.0)) return camera;
  Camera result = camera;
  const glm::dmat3 rotation = glm::dmat3(camera.world_to_camera) * glm::transpose(rotation_of(change.turn));
  result.world_to_camera = glm::dmat4(rotation);
  result.world_to_camera[3] = glm::dvec4(-(rotation * (camera.centre() + change.shift)), 1.0);
  return result;
}

std::vector<PoseChange> without_common(std::span<const Camera> cameras, std::span<const PoseChange> changes) {
  constexpr double kRidge = 1e-9;  // where few cameras do not determine the transform
  SquareMatrix<kCommon> matrix{};
  std::array<double, kCommon> right{};
  for (std::size_t k = 0; k < kCommon; ++k) matrix[k][k] = kRidge;
  const auto values_of = [](const PoseChange& c) {
    return std::array{c.turn.x, c.turn.y, c.turn.z, c.shift.x, c.shift.y, c.shift.z};
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const auto rows = rows_at(cameras[i].centre());
    const auto values = values_of(changes[i]);
    for (std::size_t r = 0; r < rows.size(); ++r)
      for (std::size_t k = 0; k < kCommon; ++k) {
        right[k] += rows[r][k] * values[r];
        for (std::size_t l = 0; l < kCommon; ++l) matrix[k][l] += rows[r][k] * rows[r][l];
      }
  }
  const auto common = solve_symmetric<kCommon>(matrix, right);
  const glm::dvec3 turn(common[0], common[1], common[2]), shift(common[3], common[4], common[5]);
  std::vector<PoseChange> rest;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const glm::dvec3 c = cameras[i].centre();
    rest.push_back({changes[i].turn - turn, changes[i].shift - glm::cross(turn, c) - shift - common[6] * c});
  }
  return rest;
}

}  // namespace trisoup::scene
