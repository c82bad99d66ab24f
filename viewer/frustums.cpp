#include "frustums.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trisoup::viewer {
namespace {

/// Of the viewer's distance: what is closer is cut off.
constexpr double kNearest = 0.05;

/// The eye and the corners of the picture, counterclockwise.
std::array<glm::dvec3, 5> corners_of(const scene::Camera& c, double length) {
  const glm::dmat3 camera_to_world = glm::transpose(glm::dmat3(c.world_to_camera));
  const auto corner = [&](double x, double y) {
    return c.centre() + length * (camera_to_world * glm::dvec3((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1.0));
  };
  return {c.centre(), corner(0, 0), corner(c.width, 0), corner(c.width, c.height), corner(0, c.height)};
}

double distance_to(const Line& line, const glm::dvec2& at) {
  const glm::dvec2 along = line[1] - line[0];
  const double share = std::clamp(glm::dot(at - line[0], along) / std::max(1e-12, glm::dot(along, along)), 0.0, 1.0);
  return glm::length(at - line[0] - share * along);
}

/// Whether `at` is inside the outline of the lines, which is convex: lines lie on both sides of every line through it.
bool encloses(const std::vector<Line>& lines, const glm::dvec2& at) {
  std::vector<double> angles;
  for (const Line& line : lines)
    for (const glm::dvec2& end : line) angles.push_back(std::atan2(end.y - at.y, end.x - at.x));
  if (angles.empty()) return false;
  std::sort(angles.begin(), angles.end());
  double gap = angles.front() + 2 * std::acos(-1.0) - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return gap < std::acos(-1.0);
}

}  // namespace

std::optional<Line> line_on_screen(const glm::dvec3& from, const glm::dvec3& to, double near,
                                   const scene::Camera& viewer) {
  glm::dvec3 a(viewer.world_to_camera * glm::dvec4(from, 1.0)), b(viewer.world_to_camera * glm::dvec4(to, 1.0));
  if (a.z < near && b.z < near) return std::nullopt;
  if (a.z < near) a = glm::mix(a, b, (near - a.z) / (b.z - a.z));
  if (b.z < near) b = glm::mix(b, a, (near - b.z) / (a.z - b.z));
  const auto pixel = [&](const glm::dvec3& p) {
    return glm::dvec2(viewer.cx + viewer.fx * p.x / p.z, viewer.cy + viewer.fy * p.y / p.z);
  };
  return Line{pixel(a), pixel(b)};
}

std::vector<Line> frustum_lines(const scene::Camera& camera, double length, const scene::Camera& viewer) {
  if (glm::length(camera.centre() - viewer.centre()) < length) return {};
  std::array<glm::dvec3, 5> corners = corners_of(camera, length);
  std::vector<Line> lines;
  constexpr std::array<std::pair<int, int>, 8> kEdges{{{0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 2}, {2, 3}, {3, 4}, {4, 1}}};
  for (const auto& [i, j] : kEdges)
    if (const auto line = line_on_screen(corners[i], corners[j], kNearest * length, viewer)) lines.push_back(*line);
  return lines;
}

std::optional<std::size_t> frustum_at(std::span<const soup::ModelCamera> cameras, double length,
                                      const scene::Camera& viewer, const glm::dvec2& at, double reach) {
  std::optional<std::size_t> found;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const double distance = glm::length(cameras[i].camera.centre() - viewer.centre());
    if (distance >= nearest) continue;
    const std::vector<Line> lines = frustum_lines(cameras[i].camera, length, viewer);
    const bool touched =
        std::any_of(lines.begin(), lines.end(), [&](const Line& line) { return distance_to(line, at) <= reach; });
    if (!touched && !encloses(lines, at)) continue;
    found = i;
    nearest = distance;
  }
  return found;
}

std::optional<std::size_t> nearest_camera(std::span<const soup::ModelCamera> cameras, const scene::Camera& viewer,
                                          double distance) {
  std::optional<std::size_t> found;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const scene::Camera& c = cameras[i].camera;
    const double angle = std::acos(std::clamp(glm::dot(c.forward(), viewer.forward()), -1.0, 1.0));
    const double difference = angle + glm::length(c.centre() - viewer.centre()) / distance;
    if (difference >= least) continue;
    found = i;
    least = difference;
  }
  return found;
}

}  // namespace trisoup::viewer
