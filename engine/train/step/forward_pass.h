// Renders any number of views in batches, without gradients, and counts what they show.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/soup_buffers.h"
#include "train/step/step.h"

namespace trisoup::train {

/// Most pixels in a batch without gradients, unless a single view has more.
inline constexpr std::uint64_t kPassPixels = 1u << 20;
/// Bytes of projected triangles that a batch may use if training has not allocated more.
inline constexpr std::uint64_t kPassScreenBytes = 32u << 20;

/// Renders the views in batches of at most `max_batch` and calls visit(first, count) after each. `buffers` then holds
/// the visible fragments (and BatchBuffers::colour if `colours`) of views first .. first + count - 1. Opacity
/// thresholds are 0.5. kPassPixels and kPassScreenBytes limit a batch further. If tile lists overflow, they are
/// enlarged and the batch is rendered again before it is visited.
void for_each_batch(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                    bool colours, const StepInputs& inputs, std::size_t max_batch,
                    const std::function<void(std::size_t, std::size_t)>& visit);

/// Number of pixels that show each triangle, over all views. [T]
std::vector<std::uint32_t> count_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                         std::span<const BatchView> views);

/// Share of the triangles, 0..1, that are visible in one view of the batch in `buffers`. record: of that view. counts:
/// scratch memory, one word per triangle.
double share_shown(gpu::Device& gpu, const SoupBuffers& soup, const BatchBuffers& buffers,
                   const kernels::ViewRecord& record, const gpu::Buffer& counts);

/// Visibility of each triangle in a set of views.
struct TriangleVisibility {
  std::vector<std::uint32_t> pixels;  // [T] number of pixels that show it, over all views
  /// [T] photograph pixels that it would cover if its scale everywhere were that at its largest visible pixel; 0: not
  /// visible.
  std::vector<std::uint32_t> area;
  std::vector<std::uint32_t> views;  // [T] number of views that show it
};
TriangleVisibility measure_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                   std::span<const BatchView> views);

/// For each view one byte per triangle: 1 if the view shows it. [views][T]
std::vector<std::vector<std::uint8_t>> visible_in_each(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                                       std::span<const BatchView> views);

/// Enlarges the tile lists if they have overflowed, clears the flag and returns the step in which they did. Waits for
/// the device.
std::optional<std::uint32_t> grow_lists_if_needed(gpu::Device& gpu, BatchBuffers& buffers);

}  // namespace trisoup::train
