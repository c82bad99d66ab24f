#include "train/start/start_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "mesh/point_spacing.h"
#include "train/start/random_start.h"

namespace trisoup::train {
namespace {

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// Removes the points for which `bad` is true from `chosen`, unless less than a third of the cloud would remain.
template <class Bad>
void drop(std::vector<std::uint32_t>& chosen, std::size_t cloud, Bad&& bad) {
  std::vector<std::uint32_t> left;
  for (const std::uint32_t i : chosen)
    if (!bad(i)) left.push_back(i);
  if (3 * left.size() >= cloud) chosen = std::move(left);
}

/// For each cell of a grid in contracted space, the point seen by the most views; of equal ones, the lowest index.
std::vector<std::uint32_t> one_per_cell(const scene::Points& points, const std::vector<std::uint32_t>& chosen,
                                        double cell) {
  std::map<std::array<int, 3>, std::uint32_t> best;
  const auto views = [&](std::uint32_t i) { return points.seen_by.empty() ? 0 : points.seen_by[i].size(); };
  for (const std::uint32_t i : chosen) {
    const glm::dvec3 c = glm::floor(contracted(glm::dvec3(points.positions[i])) / cell);
    const auto [it, fresh] = best.try_emplace({int(c.x), int(c.y), int(c.z)}, i);
    if (!fresh && views(i) > views(it->second)) it->second = i;
  }
  std::vector<std::uint32_t> result;
  for (const auto& [key, i] : best) result.push_back(i);
  std::sort(result.begin(), result.end());
  return result;
}

/// The best points of a grid whose cells leave few enough.
std::vector<std::uint32_t> thinned(const scene::Points& points, const std::vector<std::uint32_t>& chosen,
                                   std::size_t max_points) {
  // Find the smallest cell size that leaves few enough points by bisection.
  double fine = 0, coarse = 4;
  for (int i = 0; i < 24; ++i) {
    const double middle = (fine + coarse) / 2;
    (one_per_cell(points, chosen, middle).size() <= max_points ? coarse : fine) = middle;
    if (coarse - fine < 0.02 * coarse) break;
  }
  return one_per_cell(points, chosen, coarse);
}

/// For a cloud without tracks: a view sees a point whose depth is at most 1.1 times the smallest in its cell of the
/// image. The image has 32 cells across. Keeps the eight nearest views of each point.
std::vector<std::vector<std::uint32_t>> guessed_sightings(const scene::Scene& scene,
                                                          const std::vector<std::uint32_t>& chosen) {
  constexpr int kAcross = 32;
  constexpr double kBehind = 1.1;
  constexpr std::size_t kMost = 8;
  std::vector<std::vector<std::pair<double, std::uint32_t>>> candidates(chosen.size());
  for (std::uint32_t v = 0; v < scene.train.size(); ++v) {
    const scene::Camera& camera = scene.train[v].camera;
    const int down = std::max(1, kAcross * camera.height / std::max(1, camera.width));
    std::vector<double> nearest(static_cast<std::size_t>(kAcross * down), 1e30);
    std::vector<std::pair<std::size_t, double>> places(chosen.size(), {0, -1.0});
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (const auto seen = shown_at(camera, glm::dvec3(scene.points.positions[chosen[i]]))) {
        const int x = std::min(kAcross - 1, int(seen->pixel.x * kAcross / camera.width));
        const int y = std::min(down - 1, int(seen->pixel.y * down / camera.height));
        places[i] = {static_cast<std::size_t>(y * kAcross + x), seen->depth};
        nearest[places[i].first] = std::min(nearest[places[i].first], seen->depth);
      }
    for (std::size_t i = 0; i < chosen.size(); ++i)
      if (places[i].second > 0 && places[i].second <= kBehind * nearest[places[i].first])
        candidates[i].emplace_back(places[i].second, v);
  }
  std::vector<std::vector<std::uint32_t>> result(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    std::sort(candidates[i].begin(), candidates[i].end());
    candidates[i].resize(std::min(candidates[i].size(), kMost));
    for (const auto& [depth, view] : candidates[i]) result[i].push_back(view);
    std::sort(result[i].begin(), result[i].end());
  }
  return result;
}

}  // namespace

glm::dvec3 contracted(const glm::dvec3& p) {
  const double r = glm::length(p);
  return r <= 1 ? p : (2.0 - 1.0 / r) / r * p;
}

std::vector<std::uint32_t> usable_points(const scene::Points& points, std::size_t max_points) {
  const std::size_t cloud = points.positions.size() - points.distant;
  std::vector<std::uint32_t> chosen;
  std::vector<double> distances;
  for (std::uint32_t i = 0; i < cloud; ++i)
    if (const double d = glm::length(glm::dvec3(points.positions[i])); std::isfinite(d))
      chosen.push_back(i), distances.push_back(d);
  // Strays may be more than one in a hundred; a background is not a hundred times as far as nine tenths of the points.
  const double horizon = std::min(3.0 * percentile(distances, 0.99), 100.0 * percentile(distances, 0.9));
  drop(chosen, cloud, [&](std::uint32_t i) { return glm::length(glm::dvec3(points.positions[i])) > horizon; });
  if (!points.errors.empty()) {
    std::vector<double> errors;
    for (const std::uint32_t i : chosen)
      if (points.errors[i] >= 0) errors.push_back(points.errors[i]);
    const double largest = std::max(2.0, 2.0 * percentile(errors, 0.5));
    drop(chosen, cloud, [&](std::uint32_t i) { return points.errors[i] > largest; });
  }
  const std::size_t fewest = points.stereo ? 2 : 3;
  if (!points.seen_by.empty()) {
    drop(chosen, cloud, [&](std::uint32_t i) {
      const bool measured = !points.measured.empty() && points.measured[i];
      return points.seen_by[i].size() < (measured ? 1 : fewest);
    });
  } else if (chosen.size() > 8) {
    std::vector<glm::vec3> seen;
    for (const std::uint32_t i : chosen) seen.emplace_back(contracted(glm::dvec3(points.positions[i])));
    const std::vector<double> gaps = soup::nearest_distances(seen, 8);
    const double largest = percentile(gaps, 0.97);
    std::size_t k = 0;
    drop(chosen, cloud, [&](std::uint32_t) { return gaps[k++] > largest; });
  }
  if (chosen.size() > max_points) chosen = thinned(points, chosen, max_points);
  for (std::uint32_t i = 0; i < points.distant; ++i) chosen.push_back(static_cast<std::uint32_t>(cloud) + i);
  return chosen;
}

std::vector<glm::dvec3> drawn_in(std::span<const glm::dvec3> points, std::span<const glm::dvec3> cameras) {
  constexpr double kOfMost = 4, kOfCameras = 8;
  std::vector<double> distances;
  for (const glm::dvec3& p : points) distances.push_back(glm::length(p));
  double limit = kOfMost * percentile(std::move(distances), 0.9);
  for (const glm::dvec3& c : cameras) limit = std::max(limit, kOfCameras * glm::length(c));
  std::vector<glm::dvec3> result(points.begin(), points.end());
  for (glm::dvec3& p : result)
    if (const double r = glm::length(p); r > limit) p *= limit * (1.0 + std::log(r / limit)) / r;
  return result;
}

Reach reach_of(const scene::Scene& scene) {
  const std::vector<std::uint32_t> chosen = usable_points(scene.points, scene.points.positions.size());
  Reach reach;
  for (const scene::View& view : scene.train)
    reach.farthest = std::max(reach.farthest, glm::length(view.camera.centre()));
  for (const std::uint32_t i : chosen)
    reach.farthest = std::max(reach.farthest, glm::length(glm::dvec3(scene.points.positions[i])));
  const auto sightings = sightings_of(scene, chosen);
  std::vector<double> depths;
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (const std::uint32_t v : sightings[i])
      if (const auto seen = shown_at(scene.train[v].camera, glm::dvec3(scene.points.positions[chosen[i]])))
        depths.push_back(seen->depth);
  if (!depths.empty()) reach.nearest = std::clamp(0.5 * percentile(depths, 0.001), 0.0025, 0.125);
  return reach;
}

std::vector<std::vector<std::uint32_t>> sightings_of(const scene::Scene& scene,
                                                     const std::vector<std::uint32_t>& chosen) {
  if (scene.points.seen_by.empty()) return guessed_sightings(scene, chosen);
  std::vector<std::vector<std::uint32_t>> result;
  for (const std::uint32_t i : chosen) result.push_back(scene.points.seen_by[i]);
  return result;
}

}  // namespace trisoup::train
