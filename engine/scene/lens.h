// Lens distortion.
#pragma once

#include <array>
#include <optional>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Distortion of points on the image plane at depth 1, before focal length and principal point. A perspective lens with
/// zero coefficients is a pinhole.
struct Lens {
  enum class Model {
    /// Brown-Conrady: r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6), and p1, p2
    perspective,
    /// Kannala-Brandt: theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), theta = atan(r)
    fisheye
  };
  Model model = Model::perspective;
  std::array<double, 4> radial{};       // k1 to k4
  std::array<double, 3> denominator{};  // d1 to d3 (k4 to k6 in OpenCV); perspective only
  double p1 = 0, p2 = 0;                // tangential, in OpenCV's order; perspective only

  bool is_pinhole() const;  // without distortion

  /// Returns the distorted radius for the undistorted radius `r` >= 0, without tangential distortion.
  double distort_radius(double r) const;

  /// Maps an undistorted point on the image plane to its distorted position.
  glm::dvec2 distort(glm::dvec2 point) const;

  /// Returns the radius in (0, largest] up to which distort_radius increases. Beyond the corners of the photograph,
  /// fitted polynomials may decrease again, which would show the content a second time.
  double growing_until(double largest) const;
};

}  // namespace trisoup::scene
