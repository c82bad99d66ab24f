// What soup-bench measures on without a scene: a ball of random triangles, and cameras around it.
#pragma once

#include <cstdint>
#include <vector>

#include "gpu/device.h"
#include "scene/camera.h"
#include "soup/texture_table.h"
#include "train/step/soup_buffers.h"

namespace trisoup::bench {

/// Returns cameras of side x side pixels. The ball covers about half of each view with about three layers.
std::vector<scene::Camera> cameras_around(std::uint32_t views, std::uint32_t side);

/// Allocates a ball with textures of these levels and an MLP. The total area of the triangles does not depend on their
/// number.
void load_ball(gpu::Device& gpu, train::SoupBuffers& soup, std::uint32_t triangles, soup::TextureLevels levels);

}  // namespace trisoup::bench
