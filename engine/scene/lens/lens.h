// Lens distortion.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include <glm/glm.hpp>

#include "scene/fingerprint.h"

namespace trisoup::scene {

/// Distortion of points on the image plane at depth 1, before focal length and principal point. A perspective lens with
/// zero coefficients is a pinhole. Which camera model of COLMAP has which coefficients: scene/lens/camera_models.h.
struct Lens {
  /// r: distance from the axis on the image plane, theta = atan(r)
  enum class Model {
    /// Brown-Conrady: r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) / (1 + d1 r^2 + d2 r^4 + d3 r^6), and p1, p2
    perspective,
    /// Kannala-Brandt: theta (1 + k1 theta^2 + ... + k4 theta^8); p1, p2 and the prism take the point at radius theta
    fisheye,
    /// The same with k5 and k6, where p1, p2 and the prism take the point after radial distortion (Project Aria)
    fisheye_624,
    /// Devernay and Faugeras 2001: atan(2 r tan(omega / 2)) / omega; omega = k1
    field_of_view,
    /// Fitzgibbon 2001: the distorted radius q satisfies r = q / (1 + k q^2); k = k1
    division,
    /// Khomutenko et al. 2016: r / (alpha sqrt(beta r^2 + 1) + 1 - alpha); alpha = k1, beta = k2
    unified,
    /// The distorted radius q satisfies theta = q + k1 q^2 + k2 q^3 + k3 q^4 + k4 q^5 (instant-ngp)
    f_theta,
    /// Panorama: longitude and latitude are proportional to x and y. No point on an image plane: see
    /// scene/lens/panorama.h
    equirectangular
  };
  Model model = Model::perspective;
  std::array<double, 4> radial{};       // k1 to k4
  std::array<double, 3> denominator{};  // d1 to d3 (k4 to k6 in OpenCV); perspective only
  double p1 = 0, p2 = 0;                // tangential, in OpenCV's order; perspective and fisheyes
  std::array<double, 2> high{};         // k5, k6; fisheye_624 only
  std::array<double, 4> prism{};        // x: s1 r^2 + s2 r^4, y: s3 r^2 + s4 r^4; fisheyes only

  bool is_pinhole() const;  // without distortion
  bool is_panorama() const { return model == Model::equirectangular; }

  /// Returns the distorted radius for the undistorted radius `r` >= 0, without tangential and prism distortion. NaN
  /// where the model has no value.
  double distort_radius(double r) const;

  /// Maps an undistorted point on the image plane to its distorted position.
  glm::dvec2 distort(glm::dvec2 point) const;

  /// Returns the radius in (0, largest] up to which distort_radius increases. Beyond the corners of the photograph,
  /// fitted polynomials may decrease again, which would show the content a second time.
  double growing_until(double largest) const;

  /// Returns the distorted radius at which the lens folds over: the first maximum of distort_radius. nullopt if it
  /// increases up to 89 degrees from the axis.
  std::optional<double> folds_at() const;
};

/// Returns COLMAP's name of the camera model that describes the lens.
std::string_view model_name(const Lens& lens);

/// Adds the model and its coefficients.
void add_lens(Fingerprint& fingerprint, const Lens& lens);

}  // namespace trisoup::scene
