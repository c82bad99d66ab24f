// Reads the depth maps of a scene's training views.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/load/shot.h"
#include "scene/scene.h"

namespace trisoup::scene {

/// Longer side of a map in memory, pixels, at most that of the view.
inline constexpr int kLongestDepthSide = 512;

/// Bytes that the depth maps of these shots need at most.
std::uint64_t depth_bytes(const std::vector<const Shot*>& shots, const LoadOptions& options);

/// Sets View::depth of the training views whose frames have a depth map, and says in the summary how the maps fit.
/// Numbers are depths along the viewing direction; 0, negative ones, NaN and infinity are no measurement. Lens
/// distortion is removed as from photographs (scene/lens/undistort.h).
/// - metric: the unit is scaled to the sparse points, one factor for the scene. Without enough points the unit counts;
///   if the dataset tells none, and the maps agree with each other only if scaled, they are.
/// - relative, inverse: scale and shift of each map are fitted to the sparse points that its view sees.
/// A map that cannot be read, has other proportions than its photograph, or does not fit the points is left out with a
/// warning. shots: of the training views, in their order. scene: with points and normalisation.
void read_depths(Scene& scene, const std::vector<const Shot*>& shots, const LoadOptions& options);

}  // namespace trisoup::scene
