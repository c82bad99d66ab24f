// Lens distortion: where a real lens puts the ray that a pinhole would put elsewhere.
#pragma once

#include <array>
#include <optional>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Distortion on the plane at depth 1, apart from focal length and principal point. Zero coefficients are a pinhole.
struct Lens {
  enum class Model {
    perspective,  // Brown-Conrady: r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6), and p1,
                  // p2
    fisheye       // Kannala-Brandt: theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), theta = atan(r)
  };
  Model model = Model::perspective;
  std::array<double, 4> radial{};       // k1..k4
  std::array<double, 3> denominator{};  // d1..d3, called k4..k6 by OpenCV; perspective only
  double p1 = 0, p2 = 0;                // tangential, in OpenCV's order; perspective only

  bool is_pinhole() const;  // distorts nothing

  /// The radius at which the lens shows what a pinhole shows at radius `r` >= 0, without the tangential part.
  double distort_radius(double r) const;

  /// The point (x, y) of a pinhole's image plane on the lens's image plane.
  glm::dvec2 distort(glm::dvec2 point) const;

  /// The radius up to which distort_radius grows, looked for in (0, largest]. Polynomials fitted to a photograph bend
  /// back beyond its corners, and would show its content there a second time.
  double growing_until(double largest) const;
};

}  // namespace trisoup::scene
