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

/// The points of each cell of a grid in contracted space.
std::vector<std::vector<std::uint32_t>> cells_of(const scene::Points& points, std::span<const std::uint32_t> usable,
                                                 double side) {
  std::map<std::array<int, 3>, std::vector<std::uint32_t>> cells;
  for (const std::uint32_t i : usable) {
    const glm::dvec3 c = glm::floor(contracted(glm::dvec3(points.positions[i])) / side);
    cells[{int(c.x), int(c.y), int(c.z)}].push_back(i);
  }
  std::vector<std::vector<std::uint32_t>> result;
  for (auto& [key, cell] : cells) result.push_back(std::move(cell));
  return result;
}

/// The cells of the finest grid that has few enough, about.
std::vector<std::vector<std::uint32_t>> few_cells(const scene::Points& points, std::span<const std::uint32_t> usable,
                                                  std::size_t most) {
  double fine = 0, coarse = 4;
  for (int i = 0; i < 24; ++i) {
    const double middle = (fine + coarse) / 2;
    (cells_of(points, usable, middle).size() <= most ? coarse : fine) = middle;
    if (coarse - fine < 0.02 * coarse) break;
  }
  return cells_of(points, usable, coarse);
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

std::vector<std::uint32_t> usable_points(const scene::Points& points) {
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
  for (std::uint32_t i = 0; i < points.distant; ++i) chosen.push_back(static_cast<std::uint32_t>(cloud) + i);
  return chosen;
}

Thinned thinned(const scene::Points& points, const std::vector<std::uint32_t>& usable, std::size_t max_points) {
  const auto cloud = std::span(usable).first(usable.size() - points.distant);
  std::vector<std::vector<std::uint32_t>> cells;
  if (cloud.size() <= max_points)
    for (const std::uint32_t i : cloud) cells.push_back({i});
  else
    cells = few_cells(points, cloud, max_points);
  const auto fewer = [&](std::uint32_t a, std::uint32_t b) {
    return !points.seen_by.empty() && points.seen_by[a].size() < points.seen_by[b].size();
  };
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_best;  // of equal points, the first
  for (auto& cell : cells) {
    const std::uint32_t best = *std::max_element(cell.begin(), cell.end(), fewer);
    by_best[best] = std::move(cell);
  }
  for (const std::uint32_t i : std::span(usable).last(points.distant)) by_best[i] = {i};
  Thinned result;
  for (auto& [best, cell] : by_best) result.chosen.push_back(best), result.cells.push_back(std::move(cell));
  return result;
}

std::vector<glm::dvec3> drawn_in(std::span<const glm::dvec3> points, std::span<const glm::dvec3> cameras) {
  constexpr double kOfMost = 4, kLeast = 8, kMost = 64;
  std::vector<double> distances;
  double camera = 1;  // about the mean of normalised cameras, unless all stand in one place
  for (const glm::dvec3& p : points) distances.push_back(glm::length(p));
  for (const glm::dvec3& c : cameras) camera = std::max(camera, glm::length(c));
  const double limit = std::clamp(kOfMost * percentile(std::move(distances), 0.9), kLeast * camera, kMost * camera);
  std::vector<glm::dvec3> result(points.begin(), points.end());
  for (glm::dvec3& p : result)
    if (const double r = glm::length(p); r > limit) p *= limit * (1.0 + std::log(r / limit)) / r;
  return result;
}

Reach reach_of(const scene::Scene& scene) {
  const std::vector<std::uint32_t> chosen = usable_points(scene.points);
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

MergedSightings merged_sightings(const scene::Scene& scene, const Thinned& thinned) {
  MergedSightings result;
  if (scene.points.seen_by.empty()) {
    result.seen_by = guessed_sightings(scene, thinned.chosen);
    for (const auto& views : result.seen_by) result.weights.emplace_back(views.size(), 1.0f);
    return result;
  }
  std::size_t points = 0;
  for (const std::vector<std::uint32_t>& cell : thinned.cells) points += cell.size();
  const float share = static_cast<float>(thinned.cells.size()) / static_cast<float>(std::max<std::size_t>(1, points));
  for (const std::vector<std::uint32_t>& cell : thinned.cells) {
    std::map<std::uint32_t, float> views;
    for (const std::uint32_t i : cell)
      for (const std::uint32_t v : scene.points.seen_by[i]) ++views[v];
    std::vector<std::uint32_t>& seen_by = result.seen_by.emplace_back();
    std::vector<float>& weights = result.weights.emplace_back();
    for (const auto& [view, count] : views) seen_by.push_back(view), weights.push_back(std::max(1.0f, share * count));
  }
  return result;
}

}  // namespace trisoup::train
