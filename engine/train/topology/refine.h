// Topology changes of a training run (DiffSoup, section 3.4): which triangles to drop and which to split, and what
// their textures become. The decisions are made on the host, every hundred steps or so; textures never leave the
// device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "scene/scene.h"
#include "soup/texture_table.h"
#include "train/config/settings.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

struct RefineViews {
  std::span<const BatchView> half;  // every training view at kCountScale
  std::span<const BatchView> full;  // every training view at its own size
};

enum class RefineOutcome {
  done,
  out_of_pixels,  // done, but the training views have not the pixels for as many triangles as the budget
  nothing_seen    // nothing has changed: no view would show a triangle, were all opaque
};

/// Resamples after `step` completed steps. Optimiser state of vertices and textures starts anew (textures keep theirs
/// with Settings::keep_moments). most_triangles: what fits in memory. Where all triangles are transparent, the budget's
/// worth of those that cover the most pixels stays.
RefineOutcome refine(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                     const Settings& settings, std::uint64_t step, std::uint32_t most_triangles);

/// A soup with less in it.
struct Pruned {
  std::vector<std::uint32_t> kept;          // triangles, ascending
  std::vector<soup::TextureLevels> levels;  // of the textures of those
};
/// Optimiser state of vertices and textures starts anew, as with resample(). A texture that loses its finest level has
/// its values at the points that stay.
void prune(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const Pruned& pruned, const Settings& settings);

/// Which triangles are the backdrop: those that stand where nothing else can be. A budget of few triangles has none to
/// spare. vertices: 3 for each. [T]
std::vector<bool> find_backdrop(std::span<const glm::vec3> vertices, const Settings& settings);

/// From the coarse level to level_min..level_max (DiffSoup, section 3.5), or as much of it as `views`, every training
/// view at kCountScale, show (Settings::samples_per_pixel). Optimiser state starts anew.
void add_fine_levels(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                     const Settings& settings);

/// The same for a soup whose textures are of level 0 and that has not been trained, with the mean of the colours that
/// the photographs have where each triangle is visible. Opacities stay.
void paint(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
           const Settings& settings);

}  // namespace trisoup::train
