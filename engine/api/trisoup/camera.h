// A pinhole camera in the dataset's own coordinates.
#pragma once

#include <array>
#include <string>

namespace trisoup {

/// OpenCV axes: x right, y down, z forward. Pixel (i, j) covers [i, i+1) x [j, j+1), and row 0 is the top of the
/// picture.
struct Camera {
  int width = 0, height = 0;              // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  std::array<double, 16> world_to_camera{1, 0, 0, 0, 0, 1, 0, 0, 0,
                                         0, 1, 0, 0, 0, 0, 1};  // rigid, row by row; maps column vectors (x, y, z, 1)
};

/// The undistorted camera of a photograph. `name` is the photograph's path relative to the dataset.
struct View {
  std::string name;
  Camera camera;
};

}  // namespace trisoup
