// Points of a scene from its photographs and their poses.
#pragma once

#include <cstddef>
#include <span>

#include "scene/scene.h"

namespace trisoup::scene {

/// For datasets that come with poses and without points. At the most textured pixel of every cell of 4 x 4 depth is
/// swept along the pixel's ray, and where the patch around it looks alike in several neighbouring views there is a
/// point (Collins 1996, "A space-sweep approach to true multi-image matching"; patches by normalised
/// cross-correlation). Two views must have found it, each for itself, so that one that is deceived by a repeated
/// texture says nothing.
///
/// views: normalised coordinates, with their photographs. Large ones are shrunk first. Returned are positions in the
/// same coordinates, colours, and in seen_by the indices of the views that agree; errors stay empty. No point nearer to
/// its camera than an eighth of the cameras' mean distance from the centre is found. The same bits for any number of
/// threads (0: one per core). Few points, or none, where there is nothing to be matched; nothing is thrown.
Points points_from_views(std::span<const View> views, int threads = 0);

/// Fewer points than these say too little of a scene to start from.
inline constexpr std::size_t kFewestPoints = 300;

}  // namespace trisoup::scene
