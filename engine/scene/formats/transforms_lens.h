// The lens of a frame in transforms*.json.
#pragma once

#include <string>

#include "scene/formats/transforms_intrinsics.h"
#include "scene/lens/lens.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

/// Reads camera_model and the distortion coefficients of a frame. A key of the frame has priority.
/// - camera_model: COLMAP's names, and FISHEYE624 of nerfstudio; without one: is_fisheye, latlong and ftheta_p0 of
///   instant-ngp, else perspective.
/// - Coefficients by COLMAP's names, or as a list: distortion_params as in nerfstudio (k1 k2 k3 k4 p1 p2), or the names
///   of OpenCV (distortion_coefficients and others: k1 k2 p1 p2 k3 k4 k5 k6).
/// - k4 of a perspective lens is the coefficient of r^8 as in nerfstudio. With k5, k6 or FULL_OPENCV, k4 to k6 are the
///   denominator as in OpenCV, because no other model has k5 and k6.
/// - Coefficients are used with whatever camera_model, as in nerfstudio: findings has a warning if PINHOLE stands
/// beside
///   distortion, and one for each coefficient other than 0 that is not used.
/// intrinsics: focal lengths, which are replaced if the lens defines its own (f-theta).
/// Throws Error for unknown models, keys of the wrong type, and keys that contradict each other.
Lens read_lens(const FrameKeys& keys, TransformsIntrinsics& intrinsics, Findings& findings);

/// Adds warnings for keys that would change the pictures but are not read, such as rolling_shutter.
void warn_of_unread_keys(const FrameKeys& keys, Findings& findings);

}  // namespace trisoup::scene
