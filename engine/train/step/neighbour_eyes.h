// Steps that shade a photograph with the view directions of the camera beside it. What view-dependent colours paint for
// one photograph alone is then not learnt.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "train/step/batch_view.h"

namespace trisoup::train {

/// Indices of the two nearest views, nearest first, whose eyes are elsewhere; the view's own where there is none.
using Neighbours = std::array<std::uint32_t, 2>;

/// The neighbours of every view. Of equally near views, the first ones count.
std::vector<Neighbours> nearest_eyes(std::span<const BatchView> views);

/// The view whose eye a step shades a view from: for this share of steps and views one of the neighbours, both alike,
/// else the view's own index. Depends on the arguments only.
std::uint32_t seen_from(std::uint64_t seed, std::uint64_t step, std::uint32_t view, const Neighbours& neighbours,
                        double share);

}  // namespace trisoup::train
