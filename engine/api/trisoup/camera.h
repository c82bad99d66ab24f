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

/// Returns the camera at `eye` that looks at `target`, with square pixels and centred principal point. fov: vertical,
/// degrees. Throws if `up` is parallel to the viewing direction or a value is not valid.
Camera look_at(const std::array<double, 3>& eye, const std::array<double, 3>& target, const std::array<double, 3>& up,
               double fov, int width, int height);
/// Returns the camera for an image of another size that shows the same. Throws if a size is not positive.
Camera resized(const Camera& camera, int width, int height);

/// The undistorted camera of a photograph. `name` is the photograph's path relative to the dataset.
struct View {
  std::string name;
  Camera camera;
  bool test = false;  // held out of the training
};

}  // namespace trisoup
