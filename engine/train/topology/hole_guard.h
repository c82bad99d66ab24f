// Triangles without which a change of topology would open a hole.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// `kept` are the triangles that a change of topology leaves, ascending. Adds those of the others behind which `views`
/// would show the backdrop (backdrop[t]: triangle t is of it) or nothing at all, those that hide most of it first,
/// until there are `most`.
void guard_holes(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                 const std::vector<bool>& backdrop, std::size_t most, std::vector<std::uint32_t>& kept);

}  // namespace trisoup::train
