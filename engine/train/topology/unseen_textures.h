// Texture samples that no photograph shows.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "soup/soup.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Values of all samples, where those that no pixel shows are means of the seen ones around them (ScatteredMeans).
/// Opacities stay; everything stays where nothing is seen. lattice: [lattice samples][8] after the sigmoid. pixels:
/// number that show each sample, weighted. [lattice samples]. vertices: 3 per triangle. Returns values like `lattice`.
std::vector<float> fill_unseen(std::span<const glm::vec3> vertices, std::span<const soup::TextureEntry> table,
                               std::vector<float> lattice, std::span<const float> pixels);

/// The same for a soup that has been trained, in the finest level of its textures. Unseen samples have the start's
/// values, which the MLP, having changed since, turns into other colours. views: every training view at its own size.
/// SoupBuffers::lattice must have the values of SoupBuffers::source. If the soup is shared, all ranks make this call.
void fill_unseen(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views);

}  // namespace trisoup::train
