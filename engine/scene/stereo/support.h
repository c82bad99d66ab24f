// Whether the pixels around one have its plane too.
#pragma once

#include "scene/stereo/depth_maps.h"

namespace trisoup::scene {

/// Whether two inverse depths at one pixel may be of one surface. pixel_step: DepthMap::pixel_step. Where depth moves
/// pixels by little, they may differ by a pixel.
bool same_surface(double inverse_depth, double other, double pixel_step);

/// Clears the agreement of pixels with which one neighbour alone agrees, where less than a third of the pixels around
/// have a plane on the same surface. A plane that matches by chance stands alone: among 15 photographs of a table and
/// 17 of a terrace, 93 and 97 % of the planes with five sixths of support were right (5 % of depth), and 8 and 17 % of
/// those with less than a sixth, whatever they cost.
void drop_unsupported(DepthMap& map);

}  // namespace trisoup::scene
