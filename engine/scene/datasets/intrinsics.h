// Plausibility checks of cameras.
#pragma once

#include "scene/datasets/dataset.h"

namespace trisoup::scene {

/// Leaves out the frames whose camera cannot be that of a photograph, with one finding per kind of problem:
/// - a principal point outside of the image, or normalised intrinsics (fractions of the image's size);
/// - a focal length below 0.05 or above 50 times the longer side, or of at least 1e6 pixels, which no model file holds;
/// - a lens that folds over inside the undistorted image such that more than a third of the photograph lies beyond the
///   fold and shows no direction, or whose distortion is so strong that less than a quarter of the undistorted image
///   shows the photograph.
/// Adds a warning for lenses that fold over nearer to the corners (the rest is masked), for principal points that would
/// be the centre of a larger or smaller image with the same proportions, for focal lengths that contradict the field of
/// view in the file, that hardly any lens has, or that differ by more than a fifth, and for panoramas that are not
/// twice as wide as high. The usual mistake is to combine reduced images with intrinsics of the full size. Throws Error
/// if no frame is left.
void check_intrinsics(Dataset& dataset);

}  // namespace trisoup::scene
