// Photographs of a real lens, made into those of a pinhole camera.
#pragma once

#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/photograph.h"

namespace trisoup::scene {

/// The photograph that a pinhole with the same focal lengths, principal point and size would have taken. `camera` is
/// the one of the photograph (same size; its pose is not used). Keeping the focal length keeps the resolution at the
/// image centre; a barrel lens loses its outermost border, and where the pinhole looks past the photograph, pixels are
/// empty and outside of the loss. Sampled bilinearly.
Photograph undistort(const Photograph& photograph, const Camera& camera, const Lens& lens);

}  // namespace trisoup::scene
