// The camera models of COLMAP: names, numbers and parameters.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "scene/lens/lens.h"

namespace trisoup::scene {

/// A distortion coefficient of a camera model.
struct Coefficient {
  std::string_view name;  // as COLMAP names it
  double& (*of)(Lens&);
};

/// A camera model. Its parameters are the focal lengths (f, or fx and fy), the principal point (cx, cy) and the
/// coefficients. A panorama has the size of its image (w, h) instead.
struct CameraModel {
  int id;  // in binary files
  std::string_view name;
  Lens::Model lens;
  std::size_t focals;  // number of focal lengths: 1 or 2; 0: panorama
  std::span<const Coefficient> coefficients;

  std::size_t parameters() const { return focals + 2 + coefficients.size(); }

  /// Returns the names of the parameters: "f, cx, cy, k".
  std::string parameter_names() const;
};

/// Returns the camera model with an id or a name, or nullptr if COLMAP has none.
/// Source: https://colmap.github.io/cameras.html and src/colmap/sensor/models.h of COLMAP 4.
const CameraModel* find_camera_model(int id);
const CameraModel* find_camera_model(std::string_view name);

/// Returns the names of all models: "SIMPLE_PINHOLE, PINHOLE, ...".
std::string camera_model_names();

}  // namespace trisoup::scene
