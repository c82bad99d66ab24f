// Which views a view is compared with by multi-view stereo.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/scene.h"

namespace trisoup::scene {

/// Where surfaces are likely to be in a view's picture, from which neighbours and the range of depths follow.
using Probes = std::vector<glm::dvec3>;

/// Probes of each view: the points that it saw; where they are few, places along the rays of its pixels, as far as
/// points usually are, or as the scene's centre is. points: may be empty. [views]
std::vector<Probes> probes_of(std::span<const View> views, const Points& points);

/// Up to `most` views, ascending, spread evenly over positions and directions (farthest-point sampling). Views without
/// a photograph are left out.
std::vector<std::uint32_t> spread_views(std::span<const View> views, std::size_t most);

/// Up to `most` neighbours of each of the views `among`, best first. Neighbours see the same places at angles wide
/// enough to tell depth and small enough to look alike, and at a like scale; together they cover as many of the view's
/// probes as they can (Goesele et al., "Multi-view stereo for community photo collections", ICCV 2007). Where there are
/// too few such views, wider angles and scales follow. Neighbours are among them too; the other views have none.
/// [views]
std::vector<std::vector<std::uint32_t>> stereo_neighbours(std::span<const View> views, std::span<const Probes> probes,
                                                          std::span<const std::uint32_t> among, std::size_t most);

}  // namespace trisoup::scene
