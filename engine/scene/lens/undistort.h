// Removes lens distortion from photographs and depth maps.
#pragma once

#include "image/value_map.h"
#include "scene/camera.h"
#include "scene/lens/lens.h"
#include "scene/lens/photograph.h"

namespace trisoup::scene {

/// Returns the photograph as taken by a pinhole camera with the same focal lengths, principal point and size, sampled
/// bilinearly. camera: camera of the photograph, with the same size; its pose is not used. The unchanged focal length
/// keeps the resolution at the image centre. With barrel distortion the outer border is lost. Pixels that lie outside
/// the photograph are empty and excluded from the loss. lens: no panorama, for which see scene/lens/panorama.h.
Photograph undistort(const Photograph& photograph, const Camera& camera, const Lens& lens);

/// Returns the depth map of the pinhole camera `pinhole`, at its size: the nearest values of a map that a camera with
/// the lens took, because a mean over an edge would lie on no surface. camera: of the map or of its photograph, at any
/// size. Poses are not used. Values outside the map are 0.
ValueMap undistort(const ValueMap& map, const Camera& camera, const Lens& lens, const Camera& pinhole);

}  // namespace trisoup::scene
