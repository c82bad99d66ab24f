#include "train/start/exposure_balance.h"

#include <cmath>
#include <utility>

#include "common/host.h"

namespace trisoup::train {
namespace {

constexpr double kPlacesOfPhotograph = 30;  // of a photograph without which it says nothing about its exposure
constexpr int kReweightings = 12, kMostIterations = 400;
constexpr double kSlack = 0.02;  // smaller differences of colours weigh alike

using Gains = std::vector<glm::dvec3>;  // [photographs]

glm::dvec3 dot(const Gains& a, const Gains& b) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

double mean_of_channels(const glm::dvec3& v) { return (v.x + v.y + v.z) / 3; }

/// The normal equations, per channel, of sum w (odds - gain - own odds of the place)^2.
class Balance {
 public:
  Balance(const std::vector<std::vector<SeenColour>>& places, std::size_t photographs)
      : gains_(photographs, glm::dvec3(0.0)), counts_(photographs, 0.0) {
    for (const std::vector<SeenColour>& colours : places) {
      if (colours.size() < 2) continue;
      std::vector<Sighting>& place = places_.emplace_back();
      for (const SeenColour& seen : colours) {
        const glm::dvec3 c(seen.colour), slope = c * (1.0 - c);
        place.push_back(
            {seen.photograph, seen.pixels, glm::log(c / (1.0 - c)), slope, double(seen.pixels) * slope * slope});
        counts_[seen.photograph] += 1;
      }
    }
  }

  Gains solve() {
    for (int i = 0; i < kReweightings; ++i) {
      improve();
      reweight();
    }
    shrink();
    return std::move(gains_);
  }

 private:
  struct Sighting {
    std::uint32_t photograph;
    double pixels;
    glm::dvec3 odds;   // logarithm of c / (1 - c)
    glm::dvec3 slope;  // derivative of c by it
    glm::dvec3 weight;
  };

  /// Weighted mean of value(sighting) over the sightings of a place.
  template <class Value>
  static glm::dvec3 mean_over(const std::vector<Sighting>& place, Value&& value) {
    glm::dvec3 sum(0.0), weights(0.0);
    for (const Sighting& s : place) sum += s.weight * value(s), weights += s.weight;
    return sum / weights;
  }

  /// Calls f(sighting, what is left of its odds without its gain and the place's own odds, how much less the square of
  /// that is on average than with the place's true odds).
  template <class F>
  void each_rest(F&& f) {
    for (std::vector<Sighting>& place : places_) {
      const glm::dvec3 own = mean_over(place, [&](const Sighting& s) { return s.odds - gains_[s.photograph]; });
      const double less = 1 - 1 / double(place.size());
      for (Sighting& s : place) f(s, s.odds - gains_[s.photograph] - own, less);
    }
  }

  /// Makes squared differences of odds count as absolute ones of colours.
  void reweight() {
    each_rest([](Sighting& s, const glm::dvec3& rest, double) {
      s.weight = s.pixels * s.slope * s.slope / (kSlack + s.slope * glm::abs(rest));
    });
  }

  Gains multiplied(const Gains& x) const {
    Gains result(x.size(), glm::dvec3(0.0));
    for (const std::vector<Sighting>& place : places_) {
      const glm::dvec3 mean = mean_over(place, [&](const Sighting& s) { return x[s.photograph]; });
      for (const Sighting& s : place) result[s.photograph] += s.weight * (x[s.photograph] - mean);
    }
    return result;
  }

  /// Conjugate gradients (Hestenes and Stiefel 1952), preconditioned by the weights. The matrix does not determine the
  /// sum of the gains of photographs that are connected. The right side has rounding errors alone there, which the
  /// absolute part of `end` keeps out.
  void improve() {
    Gains rest(gains_.size(), glm::dvec3(0.0)), weights = rest;
    glm::dvec3 all(0.0);
    each_rest([&](const Sighting& s, const glm::dvec3& r, double) {
      rest[s.photograph] += s.weight * r;
      weights[s.photograph] += s.weight;
      all += s.weight;
    });
    const auto preconditioned = [&] {
      Gains z = rest;
      for (std::size_t v = 0; v < z.size(); ++v)
        if (counts_[v] > 0) z[v] /= weights[v];
      return z;
    };
    Gains direction = preconditioned();
    glm::dvec3 size = dot(rest, direction);
    const glm::dvec3 end = 1e-10 * size + 1e-18 * all;
    const auto over = [&](const glm::dvec3& a, const glm::dvec3& b, int c) {
      return size[c] > end[c] && b[c] > 0 ? a[c] / b[c] : 0;
    };
    for (int i = 0; i < kMostIterations && glm::any(glm::greaterThan(size, end)); ++i) {
      const Gains product = multiplied(direction);
      const glm::dvec3 curvature = dot(direction, product);
      const glm::dvec3 step(over(size, curvature, 0), over(size, curvature, 1), over(size, curvature, 2));
      for (std::size_t v = 0; v < gains_.size(); ++v) gains_[v] += step * direction[v], rest[v] -= step * product[v];
      const Gains z = preconditioned();
      const glm::dvec3 next = dot(rest, z);
      const glm::dvec3 turn(over(next, size, 0), over(next, size, 1), over(next, size, 2));
      for (std::size_t v = 0; v < gains_.size(); ++v) direction[v] = z[v] + turn * direction[v];
      size = next;
    }
  }

  /// Variance of each gain, mean over the channels, if a photograph had as much information as ten independent places:
  /// shadows and reflections are alike over large parts of it. As for the fits of steps.
  std::vector<double> variances() {
    Gains squares(gains_.size(), glm::dvec3(0.0)), weights = squares;
    each_rest([&](const Sighting& s, const glm::dvec3& rest, double less) {
      squares[s.photograph] += s.weight * rest * rest / less;
      weights[s.photograph] += s.weight;
    });
    std::vector<double> result(gains_.size());
    for (std::size_t v = 0; v < gains_.size(); ++v)
      if (counts_[v] > 0) result[v] = mean_of_channels(squares[v] / weights[v]) / 10;
    return result;
  }

  void shrink() {
    const std::vector<double> uncertain = variances();
    glm::dvec3 mean(0.0);
    double known = 0, noise = 0, spread = 0;
    for (std::size_t v = 0; v < gains_.size(); ++v)
      if (counts_[v] >= kPlacesOfPhotograph) mean += gains_[v], known += 1, noise += uncertain[v];
    for (std::size_t v = 0; v < gains_.size(); ++v) {
      gains_[v] = counts_[v] >= kPlacesOfPhotograph ? gains_[v] - mean / known : glm::dvec3(0.0);
      spread += mean_of_channels(gains_[v] * gains_[v]);
    }
    const double share = known >= 2 ? f64::exposure_share(spread / known, noise / known) : 0.0;
    for (glm::dvec3& gain : gains_) gain *= share;
  }

  std::vector<std::vector<Sighting>> places_;
  Gains gains_;
  std::vector<double> counts_;
};

}  // namespace

std::vector<glm::vec3> balanced_gains(const std::vector<std::vector<SeenColour>>& places, std::size_t photographs) {
  const Gains gains = Balance(places, photographs).solve();
  return {gains.begin(), gains.end()};
}

}  // namespace trisoup::train
