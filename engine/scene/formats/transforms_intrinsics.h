// Focal length, principal point and matrix K of a frame in transforms*.json.
#pragma once

#include <optional>

#include "scene/formats/transforms_keys.h"

namespace trisoup::scene {

struct TransformsIntrinsics {
  std::optional<double> fx, fy, cx, cy;    // pixels
  std::optional<double> angle_x, angle_y;  // field of view over the whole width and height, radians
};

/// Reads fl_x, fl_y, cx, cy (or fx and fy), camera_angle_x and camera_angle_y (radians), x_fov and y_fov (degrees, as
/// in instant-ngp), and a matrix under K, intrinsics, intrinsic, intrinsic_matrix, camera_matrix or camera_intrinsics:
/// 3 x 3, 3 x 4 or 4 x 4, as rows or as 9, 12 or 16 numbers, transposed as well; the four numbers fx, fy, cx, cy; or an
/// object with these keys. A value of another form is ignored if there is a focal length by name. Values of the frame
/// have priority over those of the file. width: of the image in pixels; 0: unknown. Throws Error for values out of
/// range, for a matrix with skew or that is none, and if two values of the frame, or two of the file, contradict each
/// other.
TransformsIntrinsics read_intrinsics(const FrameKeys& keys, int width);

}  // namespace trisoup::scene
