// Keeps triangles whose removal by refinement would open a hole.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Adds dropped triangles to `kept`, the triangles that refinement keeps, ascending, if `views` would show the backdrop
/// or nothing in their place. Adds those with the most such pixels first, until `kept` has `max_triangles` triangles.
/// backdrop: whether each triangle belongs to the backdrop. [T]
void guard_holes(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                 const std::vector<bool>& backdrop, std::size_t max_triangles, std::vector<std::uint32_t>& kept);

}  // namespace trisoup::train
