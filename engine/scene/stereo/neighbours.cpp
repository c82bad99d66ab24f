#include "scene/stereo/neighbours.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/parallel_for.h"

namespace trisoup::scene {
namespace {

constexpr std::size_t kFewProbes = 24, kManyProbes = 200;
/// Angle between the directions to a place at which depth is told best.
constexpr double kBestAngle = 13 * 3.14159265358979 / 180;

/// Up to which angle, and up to which ratio of the distances to a place, views are compared.
struct Limits {
  double angle, scale;
};
/// Surfaces look alike up to the former. Someone who walks past shows what is near at wider angles, or twice as large,
/// and perhaps never again: up to the latter, views are better than none.
constexpr Limits kAlikeLimits{50 * 3.14159265358979 / 180, 1.8}, kWideLimits{80 * 3.14159265358979 / 180, 3};
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
double worth(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& place, const Limits& limits) {
  const glm::dvec3 to_a = a - place, to_b = b - place;
  const double far_a = glm::length(to_a), far_b = glm::length(to_b);
  if (!(far_a > 0 && far_b > 0)) return 0;
  const double angle = std::acos(std::clamp(glm::dot(to_a, to_b) / (far_a * far_b), -1.0, 1.0));
  const double scale = std::max(far_a, far_b) / std::min(far_a, far_b);
  if (angle > limits.angle || scale > limits.scale) return 0;
  const double of_angle = angle < kBestAngle ? std::pow(angle / kBestAngle, 1.5)
                                             : 1.0 - 0.8 * (angle - kBestAngle) / (limits.angle - kBestAngle);
  return of_angle * (limits.scale - scale) / (limits.scale - 1);
}

/// Chooses neighbours of one view.
class Choice {
 public:
  Choice(std::span<const View> views, std::span<const std::uint32_t> among, std::uint32_t view, const Probes& probes)
      : views_(views), among_(among), view_(view), probes_(probes), open_(probes.size(), 1.0) {}

  /// Adds neighbours within the limits, until there are `most`.
  void add(const Limits& limits, std::size_t most) {
    if (chosen_.size() >= most) return;
    std::vector<std::vector<double>> worths = worths_of(limits);
    while (chosen_.size() < most) {
      double best = kLeastGain * static_cast<double>(probes_.size());
      std::optional<std::uint32_t> next;
      for (const std::uint32_t v : among_) {
        double gain = 0;
        for (std::size_t p = 0; p < worths[v].size(); ++p) gain += open_[p] * worths[v][p];
        if (gain > best) best = gain, next = v;
      }
      if (!next) break;
      // Two neighbours have to agree on a place: one alone leaves half of its worth open.
      for (std::size_t p = 0; p < open_.size(); ++p) open_[p] *= 1.0 - 0.5 * worths[*next][p];
      worths[*next].clear();
      chosen_.push_back(*next);
    }
  }

  std::vector<std::uint32_t> take() { return std::move(chosen_); }

 private:
  /// [view][probe], empty for views that cannot be neighbours, or are already.
  std::vector<std::vector<double>> worths_of(const Limits& limits) const {
    const Camera& camera = views_[view_].camera;
    std::vector<std::vector<double>> worths(views_.size());
    for (const std::uint32_t v : among_) {
      const Camera& other = views_[v].camera;
      if (v == view_ || std::find(chosen_.begin(), chosen_.end(), v) != chosen_.end()) continue;
      if (glm::dot(other.forward(), camera.forward()) < 0.2) continue;
      double sum = 0;
      std::vector<double> each(probes_.size(), 0.0);
      for (std::size_t p = 0; p < probes_.size(); ++p)
        if (shown_at(other, probes_[p])) sum += each[p] = worth(camera.centre(), other.centre(), probes_[p], limits);
      if (sum > 0) worths[v] = std::move(each);
    }
    return worths;
  }

  std::span<const View> views_;
  std::span<const std::uint32_t> among_;
  std::uint32_t view_;
  const Probes& probes_;
  std::vector<double> open_;  // share of a probe that no neighbour covers yet
  std::vector<std::uint32_t> chosen_;
};

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
    Choice choice(views, among, v, probes[v]);
    for (const Limits& limits : {kAlikeLimits, kWideLimits}) choice.add(limits, most);
    result[v] = choice.take();
  });
  return result;
}

}  // namespace trisoup::scene
