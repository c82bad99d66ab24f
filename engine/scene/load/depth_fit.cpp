#include "scene/load/depth_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/host.h"

namespace trisoup::scene {
namespace {

constexpr double kWithin = 0.1;  // relative error of samples that agree with a fit

double relative_error(const DepthFit& fit, const DepthSample& sample) {
  const double inverse = fit.inverse_of(sample.value);
  return inverse > 0 ? std::abs(inverse / sample.inverse - 1) : 1e9;
}

std::size_t agreeing_with(const DepthFit& fit, std::span<const DepthSample> samples) {
  return static_cast<std::size_t>(std::count_if(samples.begin(), samples.end(), [&](const DepthSample& sample) {
    return relative_error(fit, sample) <= kWithin;
  }));
}

/// What scale and shift are fitted to.
double fitted_value(DepthMaps kind, const DepthSample& sample) {
  return kind == DepthMaps::inverse ? sample.inverse : 1 / sample.inverse;
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Least squares of relative errors over the samples that agree with a fit. Returns it unchanged if they do not tell
/// two numbers.
DepthFit refined(const DepthFit& fit, std::span<const DepthSample> samples) {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
  for (const DepthSample& sample : samples) {
    if (relative_error(fit, sample) > kWithin) continue;
    const double x = sample.value, y = fitted_value(fit.kind, sample), weight = 1 / (y * y);
    w += weight, wx += weight * x, wy += weight * y, wxx += weight * x * x, wxy += weight * x * y;
  }
  const double determinant = w * wxx - wx * wx;
  if (!(determinant > 1e-12 * w * wxx)) return fit;
  const double scale = (w * wxy - wx * wy) / determinant;
  return {fit.kind, scale, (wy - scale * wx) / w};
}

}  // namespace

double DepthFit::inverse_of(double value) const {
  const double linear = scale * value + shift;
  if (!(linear > 0) || !std::isfinite(linear)) return 0;
  return kind == DepthMaps::inverse ? linear : 1 / linear;
}

DepthQuality quality_of(const DepthFit& fit, std::span<const DepthSample> samples) {
  std::vector<double> errors;
  for (const DepthSample& sample : samples)
    if (const double error = relative_error(fit, sample); error <= kWithin) errors.push_back(error);
  const double share = samples.empty() ? 0 : static_cast<double>(errors.size()) / static_cast<double>(samples.size());
  return {share, median_of(std::move(errors))};
}

DepthFit fit_scale(std::span<const DepthSample> samples) {
  std::vector<double> logs;
  for (const DepthSample& sample : samples) logs.push_back(-std::log(sample.inverse * sample.value));
  std::sort(logs.begin(), logs.end());
  const double window = 2 * std::log1p(kWithin);
  std::size_t best_first = 0, best_last = 0;
  for (std::size_t first = 0, last = 0; first < logs.size(); ++first) {
    while (last < logs.size() && logs[last] <= logs[first] + window) ++last;
    if (last - first > best_last - best_first) best_first = first, best_last = last;
  }
  return {DepthMaps::metric, std::exp(logs[(best_first + best_last) / 2]), 0};
}

DepthFit fit_scale_and_shift(DepthMaps kind, std::span<const DepthSample> samples) {
  constexpr std::uint32_t kTries = 300, kRefinements = 5;
  DepthFit best{kind, 0, 0};
  std::size_t most = 0;
  auto draw = [&, state = 1u]() mutable {
    state = f32::hash32(state + 0x9e3779b9u);
    return samples[state % samples.size()];
  };
  for (std::uint32_t i = 0; i < kTries && !samples.empty(); ++i) {
    const DepthSample a = draw(), b = draw();
    if (std::abs(a.value - b.value) < 1e-6 * std::max(a.value, b.value)) continue;
    const double scale = (fitted_value(kind, a) - fitted_value(kind, b)) / (a.value - b.value);
    const DepthFit fit{kind, scale, fitted_value(kind, a) - scale * a.value};
    const std::size_t agree = scale > 0 ? agreeing_with(fit, samples) : 0;
    if (agree > most) best = fit, most = agree;
  }
  for (std::uint32_t i = 0; i < kRefinements && best.scale > 0; ++i) {
    const DepthFit next = refined(best, samples);
    if (!(next.scale > 0) || agreeing_with(next, samples) < agreeing_with(best, samples)) break;
    best = next;
  }
  return best;
}

bool beats_one_depth(const DepthFit& fit, std::span<const DepthSample> samples) {
  constexpr double kOneDepth = 0.03, kBetter = 0.7;
  std::vector<double> inverses, own, one;
  for (const DepthSample& sample : samples) inverses.push_back(sample.inverse);
  const double median = median_of(inverses);
  for (const DepthSample& sample : samples) {
    own.push_back(relative_error(fit, sample));
    one.push_back(std::abs(median / sample.inverse - 1));
  }
  const double plain = median_of(std::move(one));
  return plain < kOneDepth || median_of(std::move(own)) < kBetter * plain;
}

}  // namespace trisoup::scene
