#include "scene/up_direction.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "scene/ground_planes.h"

namespace trisoup::scene {
namespace {

// Costs of an assumed up direction, per camera. They were chosen on the rigs of tests/host/up_direction_test.cpp.
constexpr double kSideways = 0.3;    // portrait instead of landscape, or the other way round
constexpr double kUpsideDown = 0.8;  // camera upside down
constexpr double kSteep = 0.7;       // camera looks straight down; looking straight up costs half as much again
constexpr double kClimb = 0.15;      // all cameras above one another: people walk on the ground
constexpr double kGround = 0.35;     // gain if all points are on a plane across the up direction
constexpr double kOnlyGround = 1;    // the same if no direction suits the cameras
constexpr double kUnsuitable = 0.5;  // least cost of cameras that no direction suits
constexpr double kRoll = 0.17;       // radians: a camera that is rolled by this much costs 0.5
constexpr double kGroundSine = 0.26;
constexpr double kFinalHabit = 0.05;
constexpr double kMargin = 0.02;  // a smaller gain over the mean of the cameras does not count
constexpr double kFewCameras = 0.5;
constexpr std::size_t kMostCameras = 300;

// Axes of a camera as it was held: unit vectors in world space. `level` points to the right in the upright photograph.
struct Held {
  glm::dvec3 level, up, forward, centre;
};

struct Evidence {
  std::vector<Held> cameras;
  glm::dmat3 motion{0.0};                   // covariance of the cameras' centres, trace 1; 0 if they do not move
  std::vector<GroundPlane> planes, ground;  // all, and those that count for the up direction
  double ground_gain = 0;
};

glm::dvec3 row(const Camera& camera, int i) {
  return {camera.world_to_camera[0][i], camera.world_to_camera[1][i], camera.world_to_camera[2][i]};
}

// The EXIF orientation says at which side of the stored photograph the top is. Mirroring does not
// change that.
Held held(const Camera& camera, int orientation) {
  const glm::dvec3 x = row(camera, 0), y = row(camera, 1), z = row(camera, 2);
  Held h{x, -y, z, camera.centre()};
  if (orientation == 3 || orientation == 4) h.level = -x, h.up = y;
  if (orientation == 5 || orientation == 6) h.level = -y, h.up = -x;
  if (orientation == 7 || orientation == 8) h.level = y, h.up = x;
  return h;
}

std::vector<Held> held_cameras(std::span<const Camera> cameras, std::span<const int> orientations) {
  std::vector<Held> result;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    result.push_back(held(cameras[i], i < orientations.size() ? orientations[i] : 1));
  return result;
}

glm::dvec3 mean_of_ups(const std::vector<Held>& cameras) {
  glm::dvec3 sum(0.0);
  for (const Held& c : cameras) sum += c.up;
  const double length = glm::length(sum);
  return length > 1e-3 * double(cameras.size()) ? sum / length : glm::dvec3(0.0);
}

// Mean viewing direction, not normalised: its length is near 1 if all cameras look the same way.
glm::dvec3 mean_forward(const std::vector<Held>& cameras) {
  glm::dvec3 sum(0.0);
  for (const Held& c : cameras) sum += c.forward / double(cameras.size());
  return sum;
}

glm::dmat3 motion_of(const std::vector<Held>& cameras) {
  glm::dvec3 mean(0.0);
  for (const Held& c : cameras) mean += c.centre / double(cameras.size());
  glm::dmat3 sum(0.0);
  double trace = 0;
  for (const Held& c : cameras) {
    sum += glm::outerProduct(c.centre - mean, c.centre - mean);
    trace += glm::dot(c.centre - mean, c.centre - mean);
  }
  return trace > 1e-12 ? sum / trace : glm::dmat3(0.0);
}

double cost_of_camera(const Held& c, const glm::dvec3& up, double habit) {
  const double a = glm::dot(c.up, up), b = glm::dot(c.level, up), down = glm::dot(c.forward, up);
  const bool sideways = std::abs(b) > std::abs(a);
  const double roll = sideways ? std::atan2(std::abs(a), std::abs(b)) : std::atan2(std::abs(b), std::abs(a));
  const double turned = sideways ? kSideways : a < 0 ? kUpsideDown : 0;
  // The roll of a camera that looks straight down is undefined. Beyond 60 degrees it counts less.
  return std::min(1.0, 4 * (a * a + b * b)) * (roll * roll / (roll * roll + kRoll * kRoll) + turned) +
         habit * kSteep * std::abs(down * down * down) * (down > 0 ? 1.5 : 1);
}

// 1 if `up` is the plane's normal, 0 from 15 degrees on.
double agreement(const GroundPlane& plane, const glm::dvec3& up) {
  const double cosine = glm::dot(plane.normal, up);
  return cosine > 0 ? std::max(0.0, 1 - (1 - cosine * cosine) / (kGroundSine * kGroundSine)) : 0.0;
}

// habit: weight of what people usually do, namely look ahead and walk on level ground. It decides between directions
// that are far apart (1), but should hardly tilt the result (kFinalHabit): it is an error that all cameras share.
double cost(const Evidence& evidence, const glm::dvec3& up, double habit) {
  double sum = 0, ground = 0;
  for (const Held& c : evidence.cameras) sum += cost_of_camera(c, up, habit);
  for (const GroundPlane& plane : evidence.ground) ground = std::max(ground, plane.share * agreement(plane, up));
  return sum / double(evidence.cameras.size()) + habit * kClimb * glm::dot(up, evidence.motion * up) -
         evidence.ground_gain * ground;
}

// Moves `up` downhill in ever smaller steps.
glm::dvec3 refined(const Evidence& evidence, glm::dvec3 up, double habit) {
  double least = cost(evidence, up, habit);
  for (double step = 0.03; step > 1e-4;) {
    const glm::dvec3 helper = std::abs(up.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(helper, up)), y = glm::cross(up, x);
    glm::dvec3 best = up;
    for (int i = 0; i < 8; ++i) {
      const double angle = std::numbers::pi * i / 4;
      const glm::dvec3 other = glm::normalize(up + step * (std::cos(angle) * x + std::sin(angle) * y));
      if (const double c = cost(evidence, other, habit); c < least) least = c, best = other;
    }
    if (best == up) step *= 0.5;
    up = best;
  }
  return up;
}

// Searches the whole sphere, on a Fibonacci lattice with points 3 degrees apart, so that no start is favoured.
glm::dvec3 least_cost(const Evidence& evidence, const glm::dvec3& mean) {
  constexpr int kCount = 4000;
  std::vector<glm::dvec3> starts;
  if (mean != glm::dvec3(0.0)) starts.push_back(mean);
  for (const GroundPlane& plane : evidence.ground) starts.push_back(plane.normal);
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < kCount; ++i) {
    const double z = 1 - (2 * i + 1.0) / kCount, r = std::sqrt(1 - z * z);
    starts.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  glm::dvec3 best = starts.front();
  double least = cost(evidence, best, 1);
  for (const glm::dvec3& start : starts)
    if (const double c = cost(evidence, start, 1); c < least) least = c, best = start;
  return refined(evidence, best, 1);
}

// Whether two unit vectors are less than some degrees apart. False if one is 0.
bool within(double degrees, const glm::dvec3& a, const glm::dvec3& b) {
  return glm::dot(a, b) > std::cos(degrees * std::numbers::pi / 180);
}

// A few cameras that agree, such as three above one another, do not suffice to look for a direction far from theirs.
double far_margin(const Evidence& evidence) {
  glm::dvec3 sum(0.0);
  for (const Held& c : evidence.cameras) sum += c.up;
  const double count = double(evidence.cameras.size()), agreement = glm::length(sum) / count;
  return agreement > 0.5 ? std::max(kMargin, kFewCameras / count) : kMargin;
}

// Returns the mean of the cameras unless another direction is clearly better.
glm::dvec3 best_direction(const Evidence& evidence, const glm::dvec3& mean) {
  const glm::dvec3 coarse = least_cost(evidence, mean);
  const bool far = !within(30, coarse, mean);
  if (far && mean != glm::dvec3(0.0) && cost(evidence, mean, 1) - cost(evidence, coarse, 1) < far_margin(evidence))
    return mean;
  const glm::dvec3 fine = refined(evidence, coarse, kFinalHabit);
  if (!within(30, fine, coarse)) return far ? coarse : mean;
  if (within(30, fine, mean) && cost(evidence, mean, kFinalHabit) - cost(evidence, fine, kFinalHabit) < kMargin)
    return mean;
  return fine;
}

// A drone that maps the ground without turning looks like a phone that is moved along a wall. But it looks straight at
// the plane, and covers an area that is wide in both directions compared with its distance.
bool maps_ground(const Evidence& evidence, const glm::dvec3& up) {
  if (evidence.planes.empty() || evidence.cameras.size() < 4) return false;
  const GroundPlane& plane = evidence.planes.front();
  const glm::dvec3 forward = mean_forward(evidence.cameras);
  if (plane.share < 0.35 || glm::length(forward) < 0.97) return false;
  if (!within(6, -plane.normal, glm::normalize(forward))) return false;
  if (std::abs(glm::dot(plane.normal, up)) > 0.5) return false;  // it is the ground already
  glm::dvec3 mean(0.0);
  double upwards = 0;
  const double count = double(evidence.cameras.size());
  for (const Held& c : evidence.cameras) mean += c.centre / count;
  for (const Held& c : evidence.cameras) upwards += std::pow(glm::dot(c.centre - mean, up), 2) / count;
  return std::sqrt(upwards) > 0.12 * (glm::dot(plane.normal, mean) - plane.offset);
}

double ground_share(const Evidence& evidence, const glm::dvec3& up) {
  double share = 0;
  for (const GroundPlane& plane : evidence.planes)
    if (within(15, plane.normal, up)) share = std::max(share, plane.share);
  return share;
}

// Whether the cameras look down at one place from several sides. People in a room look at its walls and its ceiling.
bool looks_down_inwards(const Evidence& evidence, const glm::dvec3& up) {
  double down = 0, inwards = 0;
  const double count = double(evidence.cameras.size());
  for (const Held& c : evidence.cameras) {
    const glm::dvec3 ahead = c.forward - up * glm::dot(c.forward, up), to = -c.centre + up * glm::dot(c.centre, up);
    down -= glm::dot(c.forward, up) / count;
    inwards += glm::dot(ahead, to) / std::max(1e-9, glm::length(ahead) * glm::length(to)) / count;
  }
  return down > 0.1 && inwards > 0.5;
}

bool are_below_cameras(std::span<const glm::vec3> points, const Evidence& evidence, const glm::dvec3& up) {
  double height = 0;
  for (const Held& c : evidence.cameras) height += glm::dot(c.centre, up) / double(evidence.cameras.size());
  const auto below = std::count_if(points.begin(), points.end(),
                                   [&](const glm::vec3& p) { return glm::dot(glm::dvec3(p), up) < height; });
  return 5 * below >= 4 * std::ssize(points);
}

// Returns the up direction if all cameras are upside down, or 0 if they are not. Only the ground can tell. A ceiling
// is a plane above the cameras, too, so several things must agree.
glm::dvec3 overturned(Evidence evidence, std::span<const glm::vec3> points, const glm::dvec3& up) {
  const glm::dvec3 none(0.0);
  if (evidence.planes.empty() || ground_share(evidence, up) > 0.1) return none;
  for (Held& c : evidence.cameras) c.level = -c.level, c.up = -c.up;
  const glm::dvec3 other = best_direction(evidence, mean_of_ups(evidence.cameras));
  const bool agrees = glm::dot(other, up) < 0 && ground_share(evidence, other) > 0.25 &&
                      looks_down_inwards(evidence, other) && are_below_cameras(points, evidence, other);
  return agrees ? other : none;
}

// Planes that are not across the view of cameras which all look the same way: such a plane may be a wall.
std::vector<GroundPlane> without_walls(std::vector<GroundPlane> planes, const std::vector<Held>& cameras) {
  const glm::dvec3 forward = mean_forward(cameras);
  if (glm::length(forward) > 0.9)
    std::erase_if(planes, [&](const GroundPlane& plane) { return within(20, -plane.normal, glm::normalize(forward)); });
  return planes;
}

Evidence evidence_of(const std::vector<Held>& cameras, std::span<const glm::vec3> points) {
  Evidence evidence;
  std::vector<glm::dvec3> centres;
  const std::size_t count = std::min(cameras.size(), kMostCameras);
  for (std::size_t i = 0; i < count; ++i) {
    evidence.cameras.push_back(cameras[i * cameras.size() / count]);
    centres.push_back(evidence.cameras.back().centre);
  }
  evidence.motion = motion_of(evidence.cameras);
  const glm::dvec3 alone = least_cost(evidence, mean_of_ups(evidence.cameras));
  evidence.planes = ground_planes(points, centres);
  evidence.ground_gain = cost(evidence, alone, 1) > kUnsuitable ? kOnlyGround : kGround;
  evidence.ground = without_walls(evidence.planes, evidence.cameras);
  return evidence;
}

}  // namespace

UpDirection up_direction(std::span<const Camera> cameras, std::span<const int> orientations,
                         std::span<const glm::vec3> points) {
  if (cameras.empty()) return {};
  const std::vector<Held> as_stored = held_cameras(cameras, {}), as_held = held_cameras(cameras, orientations);
  const Evidence evidence = evidence_of(as_held, points);
  const glm::dvec3 stored_mean = mean_of_ups(as_stored), held_mean = mean_of_ups(as_held);

  UpDirection result{best_direction(evidence, held_mean), "level cameras"};
  if (within(3, result.direction, held_mean))
    result = {held_mean, within(3, held_mean, stored_mean) ? "" : "EXIF orientation"};
  if (maps_ground(evidence, result.direction))
    result = {evidence.planes.front().normal, "the ground, which all cameras look straight at"};
  else if (const glm::dvec3 other = overturned(evidence, points, result.direction); other != glm::dvec3(0.0))
    result = {other, "the ground, as all cameras are upside down"};
  else if (glm::dot(mean_forward(evidence.cameras), result.direction) < -0.97)
    result.reason = "cameras that look straight down";
  else if (result.reason == "level cameras" && ground_share(evidence, result.direction) > 0.1)
    result.reason = "level cameras and the ground";
  if (within(3, result.direction, stored_mean)) result = {stored_mean, ""};
  return result;
}

}  // namespace trisoup::scene
