// Whether a camera that was estimated from photographs can be theirs.
#pragma once

#include <string>

#include "scene/camera.h"
#include "scene/lens/lens.h"

namespace trisoup::scene {

/// Largest relative difference between the focal length that is found and that of EXIF.
inline constexpr double kMostOffExif = 0.2;

/// Returns why the camera cannot be true, as a phrase for a message: "focal length of 221 pixels, but EXIF says 640".
/// Empty: it can be. A perspective or fisheye lens of a consumer's camera is expected, not cropped. exif_focal: pixels
/// of `camera`; 0: unknown.
///
/// A few photographs of a place, or photographs along a line, hardly determine a lens: distortion and focal length make
/// up for each other and for the shape of the scene, at a low reprojection error. So that error cannot tell.
std::string implausibility(const Camera& camera, const Lens& lens, double exif_focal);

}  // namespace trisoup::scene
