#include "scene/stereo/neighbours.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/parallel_for.h"

namespace trisoup::scene {
namespace {

constexpr std::size_t kFewProbes = 24, kManyProbes = 200;
/// Angle between the directions to a place at which depth is told best, and the angle up to which surfaces look alike.
constexpr double kBestAngle = 13 * 3.14159265358979 / 180, kLargestAngle = 50 * 3.14159265358979 / 180;
constexpr double kLargestScale = 1.8;  // ratio of distances to a place
/// Smallest gain of a further neighbour, as a share of the probes.
constexpr double kLeastGain = 0.01;

double median(std::vector<double>& values) {
  if (values.empty()) return 1.0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Places on a grid of the view's pixels at half, once and twice `depth`.
void add_guesses(const Camera& camera, double depth, std::vector<glm::dvec3>& places) {
  const glm::dmat4 to_world = glm::inverse(camera.world_to_camera);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 6; ++i)
      for (const double share : {0.5, 1.0, 2.0}) {
        const double x = (i + 0.5) / 6 * camera.width, y = (j + 0.5) / 4 * camera.height, z = share * depth;
        places.emplace_back(to_world *
                            glm::dvec4(z * (x - camera.cx) / camera.fx, z * (y - camera.cy) / camera.fy, z, 1.0));
      }
}

/// How well a view at `b` tells the depth of a place that a view at `a` sees: 0 to 1.
double worth(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& place) {
  const glm::dvec3 to_a = a - place, to_b = b - place;
  const double far_a = glm::length(to_a), far_b = glm::length(to_b);
  if (!(far_a > 0 && far_b > 0)) return 0;
  const double angle = std::acos(std::clamp(glm::dot(to_a, to_b) / (far_a * far_b), -1.0, 1.0));
  const double scale = std::max(far_a, far_b) / std::min(far_a, far_b);
  if (angle > kLargestAngle || scale > kLargestScale) return 0;
  const double of_angle = angle < kBestAngle ? std::pow(angle / kBestAngle, 1.5)
                                             : 1.0 - 0.8 * (angle - kBestAngle) / (kLargestAngle - kBestAngle);
  return of_angle * (kLargestScale - scale) / (kLargestScale - 1);
}

std::vector<std::uint32_t> neighbours_of(std::span<const View> views, std::span<const std::uint32_t> among,
                                         std::uint32_t view, const Probes& probes, std::size_t most) {
  const glm::dvec3 centre = views[view].camera.centre();
  const std::size_t count = probes.size();
  std::vector<std::vector<double>> worths(views.size());
  for (const std::uint32_t v : among) {
    if (v == view) continue;
    if (glm::dot(views[v].camera.forward(), views[view].camera.forward()) < 0.2) continue;
    const glm::dvec3 other = views[v].camera.centre();
    double sum = 0;
    std::vector<double> each(count, 0.0);
    for (std::size_t p = 0; p < count; ++p)
      if (shown_at(views[v].camera, probes[p])) sum += each[p] = worth(centre, other, probes[p]);
    if (sum > 0) worths[v] = std::move(each);
  }
  std::vector<double> open(count, 1.0);  // share of a probe that no neighbour covers yet
  std::vector<std::uint32_t> chosen;
  while (chosen.size() < most) {
    double best = kLeastGain * static_cast<double>(count);
    std::optional<std::uint32_t> next;
    for (const std::uint32_t v : among) {
      double gain = 0;
      for (std::size_t p = 0; p < worths[v].size(); ++p) gain += open[p] * worths[v][p];
      if (gain > best) best = gain, next = v;
    }
    if (!next) break;
    // Two neighbours have to agree on a place: one alone leaves half of its worth open.
    for (std::size_t p = 0; p < count; ++p) open[p] *= 1.0 - 0.5 * worths[*next][p];
    worths[*next].clear();
    chosen.push_back(*next);
  }
  return chosen;
}

}  // namespace

std::vector<Probes> probes_of(std::span<const View> views, const Points& points) {
  std::vector<Probes> probes(views.size());
  std::vector<std::vector<std::uint32_t>> seen(views.size());
  if (points.seen_by.empty()) {
    for (std::uint32_t v = 0; v < views.size(); ++v)
      for (std::uint32_t i = 0; i < points.positions.size(); ++i)
        if (shown_at(views[v].camera, glm::dvec3(points.positions[i]))) seen[v].push_back(i);
  } else {
    for (std::uint32_t i = 0; i < points.seen_by.size(); ++i)
      for (const std::uint32_t v : points.seen_by[i]) seen[v].push_back(i);
  }
  std::vector<double> depths;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::size_t every = std::max<std::size_t>(1, seen[v].size() / kManyProbes);
    for (std::size_t k = 0; k < seen[v].size(); k += every) {
      const glm::dvec3 place(points.positions[seen[v][k]]);
      if (const auto at = shown_at(views[v].camera, place)) depths.push_back(at->depth), probes[v].push_back(place);
    }
  }
  const double usual = median(depths);
  for (std::size_t v = 0; v < views.size(); ++v)
    if (probes[v].size() < kFewProbes) add_guesses(views[v].camera, usual, probes[v]);
  return probes;
}

std::vector<std::uint32_t> spread_views(std::span<const View> views, std::size_t most) {
  std::vector<std::uint32_t> left;
  for (std::uint32_t v = 0; v < views.size(); ++v)
    if (!views[v].image.rgba.empty()) left.push_back(v);
  if (left.size() <= most) return left;
  std::vector<std::uint32_t> chosen;
  std::vector<double> gaps(views.size(), 1e30);  // to the chosen views
  for (std::uint32_t next = left.front(); chosen.size() < most;) {
    chosen.push_back(next);
    const Camera& camera = views[next].camera;
    gaps[next] = -1;
    for (const std::uint32_t v : left)
      // Cameras are at distance 1 from the centre on average: opposite directions count as two of these.
      gaps[v] = std::min(gaps[v], glm::distance(views[v].camera.centre(), camera.centre()) +
                                      glm::distance(views[v].camera.forward(), camera.forward()));
    for (const std::uint32_t v : left)
      if (gaps[v] > gaps[next]) next = v;
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<std::vector<std::uint32_t>> stereo_neighbours(std::span<const View> views, std::span<const Probes> probes,
                                                          std::span<const std::uint32_t> among, std::size_t most) {
  std::vector<std::vector<std::uint32_t>> result(views.size());
  parallel_for(static_cast<int>(among.size()), 0, [&](int i) {
    const std::uint32_t v = among[static_cast<std::size_t>(i)];
    result[v] = neighbours_of(views, among, v, probes[v], most);
  });
  return result;
}

}  // namespace trisoup::scene
