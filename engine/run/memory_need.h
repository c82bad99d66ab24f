// Estimates the device memory of a training before anything is allocated.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Pixels and tiles (8 x 8 pixels) of the largest possible batch.
struct BatchSize {
  std::uint32_t views = 0;
  std::uint64_t pixels = 0, tiles = 0;
};
BatchSize largest_batch(const std::vector<scene::View>& views, const Settings& settings);

/// Upper limit for `most_triangles` when it is not given: the most triangles that splitting may create.
std::uint64_t default_most_triangles(const Settings& settings);

/// Device memory of a training, bytes. A training with the synthetic recipe may exceed this estimate: `triangles` is
/// not a hard limit there, and all triangles that are visible when textures become fine are kept.
struct MemoryNeed {
  std::uint64_t photographs = 0, buffers = 0, soup = 0;
  std::uint64_t total() const { return photographs + buffers + soup; }
};
/// Memory of each of `ranks` ranks.
MemoryNeed memory_need(const scene::Scene& scene, const Settings& settings, std::uint32_t ranks = 1);
/// Budget and memory limit for another attempt after a training ran out of memory.
struct Smaller {
  std::uint32_t triangles = 0;  // budget; 0: no budget fits
  std::uint64_t memory = 0;     // limit, bytes: below `available` if the training needed more than estimated
};
/// needed: bytes that a training with these settings needed. available: bytes that the device has.
Smaller smaller_run(const scene::Scene& scene, const Settings& settings, std::uint64_t needed, std::uint64_t available);
/// The largest `triangles`, at most the current value, for which memory_need is at most `bytes`; 0 if none fits.
std::uint32_t triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                 std::uint32_t ranks = 1);
/// The smallest power of two, at most 64, by which the sides of all images must be divided so that memory_need is at
/// most `bytes`; 0 if none is enough.
std::uint32_t shrinking_that_fits(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                  std::uint32_t ranks = 1);
/// Lowers the ceiling of a budget that the surface decides on to what fits in `bytes`.
void limit_budget(const scene::Scene& scene, Settings& settings, std::uint64_t bytes, std::uint32_t ranks = 1);
/// Disk space that the files of a training need at most, bytes: the checkpoint, which exists twice while it is
/// replaced, the model and the renderings of the test views.
std::uint64_t disk_need(const scene::Scene& scene, const Settings& settings);
/// The most triangles that splitting may create within `bytes`: the default of Settings::most_triangles. At least
/// `triangles`.
std::uint32_t most_triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                      std::uint32_t ranks = 1);

}  // namespace trisoup::train
