// Refinement: drops and splits triangles during training (DiffSoup, section 3.4), and changes their texture levels. The
// host decides, about every hundred steps. Textures stay on the device.
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
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

struct RefineViews {
  std::span<const BatchView> half;  // every training view at kCountScale
  std::span<const BatchView> full;  // every training view at its own size
};

enum class RefineOutcome {
  done,
  out_of_pixels,  // done, but the training views have too few pixels for the budget of triangles
  nothing_seen    // nothing changed, because no view would show a triangle even if all were opaque
};

/// Refines the soup after `step` completed steps. Resets the optimiser state of vertices and textures. If all triangles
/// are transparent, keeps those that cover the most pixels, up to the budget. most_triangles: ceiling of splits by edge
/// length (real recipe), which memory limits.
RefineOutcome refine(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                     const Settings& settings, std::uint64_t step, std::uint32_t most_triangles);

/// The triangles and texture levels that remain after pruning.
struct Pruned {
  std::vector<std::uint32_t> kept;          // triangles, ascending
  std::vector<soup::TextureLevels> levels;  // of their textures
};
/// Removes the triangles and levels that are not in `pruned`. Resets the optimiser state of vertices and textures. A
/// texture that loses its finest level keeps its values at the points of the coarser one.
void prune(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const Pruned& pruned, const Settings& settings);

/// The backdrop's vertices, and no others, are farther from the origin than this share of its radius.
inline constexpr double kBackdropShare = 0.8;
/// Whether each triangle belongs to the backdrop: all its vertices are beyond kBackdropShare of its radius. All
/// false if these are more than a quarter of the budget. vertices: 3 per triangle. [T]
std::vector<bool> find_backdrop(std::span<const glm::vec3> vertices, const Settings& settings);

/// Replaces the coarse texture level by levels level_min..level_max (coarse to fine, as in DiffSoup), limited by
/// the size of the triangles in `views` (Settings::samples_per_pixel). Resets the optimiser state. views: every
/// training view at kCountScale.
void add_fine_levels(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                     const Settings& settings);

/// Splits triangles of an untrained surface, with textures of level 0, of which the photographs that show them have
/// more than two pixels per sample of level_max: places with few points, far or plain, have few and large triangles. If
/// the budget has no room, the least visible of those triangles go that the first refinement would drop.
void split_coarse(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                  const Settings& settings);

/// Chooses the levels of an untrained soup with textures of level 0 as add_fine_levels() does. Fills the textures with
/// the mean of the photographs' colours, without their exposures, where each triangle is visible. Opacities stay.
/// exposures: null for none.
void paint(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
           const Exposures* exposures, const Settings& settings);

}  // namespace trisoup::train
