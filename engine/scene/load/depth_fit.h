// Fits the numbers of depth maps to sparse points.
#pragma once

#include <cstddef>
#include <span>

#include "scene/scene.h"

namespace trisoup::scene {

/// A sparse point that a depth map shows.
struct DepthSample {
  double value = 0;    // the map's number, above 0
  double inverse = 0;  // inverse depth of the point in the view, above 0
};

/// How numbers become depths: metric: depth = scale value; relative: depth = scale value + shift; inverse: 1 / depth =
/// scale value + shift.
struct DepthFit {
  DepthMaps kind = DepthMaps::metric;
  double scale = 1, shift = 0;

  /// Returns the inverse depth of a number; 0: it has none.
  double inverse_of(double value) const;
};

/// How well a fit explains samples.
struct DepthQuality {
  double share = 0;  // of the samples within a tenth
  double error = 0;  // median relative error of inverse depth of these; 0 without samples
};
DepthQuality quality_of(const DepthFit& fit, std::span<const DepthSample> samples);

/// Returns the metric fit with the scale on which most samples agree, so that up to half of them, such as points behind
/// the surfaces that a view shows, may be wrong. samples: at least one.
DepthFit fit_scale(std::span<const DepthSample> samples);

/// Returns the fit of scale and shift that most samples agree on: RANSAC (Fischler, Bolles 1981), then least squares of
/// relative errors over the samples that agree. The same for the same samples. The scale is above 0; if no such fit
/// exists it is 0. kind: relative or inverse.
DepthFit fit_scale_and_shift(DepthMaps kind, std::span<const DepthSample> samples);

/// Returns whether the map tells more of the samples than one depth for all would, or these have nearly one depth.
bool beats_one_depth(const DepthFit& fit, std::span<const DepthSample> samples);

}  // namespace trisoup::scene
