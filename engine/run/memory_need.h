// What a run needs of a device's memory, told before anything is allocated.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene.h"
#include "train/config/settings.h"

namespace trisoup::train {

/// Pixels and tiles of the largest batch that can come up.
struct BatchSize {
  std::uint32_t views = 0;
  std::uint64_t pixels = 0, tiles = 0;
};
BatchSize largest_batch(const std::vector<scene::View>& views, const Settings& settings);

/// Triangles that splitting may reach where nobody said.
std::uint64_t default_most_triangles(const Settings& settings);

/// Device memory that a run needs, before anything is allocated. The synthetic recipe's budget is no ceiling: where
/// more than that is visible at the change to fine textures, a run needs more, and says so then.
struct MemoryNeed {
  std::uint64_t photographs = 0, buffers = 0, soup = 0;
  std::uint64_t total() const { return photographs + buffers + soup; }
};
MemoryNeed memory_need(const scene::Scene& scene, const Settings& settings,
                       std::uint32_t ranks = 1);  // of each of them
/// What a run with these settings, which needed `needed` bytes, should be given where there are `available`.
struct Smaller {
  std::uint32_t triangles = 0;  // budget; 0: none will do
  std::uint64_t memory = 0;     // bytes to plan with: less than there are where the run needed more than was planned
};
Smaller smaller_run(const scene::Scene& scene, const Settings& settings, std::uint64_t needed, std::uint64_t available);
/// The largest budget of which memory_need is at most `bytes`, all else being as it is; 0 when none is.
std::uint32_t triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                 std::uint32_t ranks = 1);
/// How far splitting may go beyond the budget in `bytes`: what Settings::most_triangles is set to where nobody said.
std::uint32_t most_triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                      std::uint32_t ranks = 1);

}  // namespace trisoup::train
