// The forward half of a step over any number of views, a few at a time.
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

/// Most pixels that a pass without gradients takes at once.
inline constexpr std::uint64_t kPassPixels = 1u << 20;
/// Room for projected triangles that a pass may take where training has not taken more.
inline constexpr std::uint64_t kPassScreenBytes = 32u << 20;

/// Calls visit(first, count) after the visible fragments (and, with colours, BatchBuffers::colour) of views first ..
/// first + count - 1 are in `frame`. Thresholds are 0.5. A batch has at most `most` views, and no more than have room.
/// Lists that do not fit are grown and the batch is done again before it is visited.
void for_each_batch(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                    bool colours, const StepInputs& inputs, std::size_t most,
                    const std::function<void(std::size_t, std::size_t)>& visit);

/// Pixels that each triangle wins over all views together. [T]
std::vector<std::uint32_t> count_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                         std::span<const BatchView> views);

/// Share of the triangles, 0..1, that win a pixel of one view of the batch in `frame`. record: that view's place there.
/// counts: room for a word for each triangle.
double share_shown(gpu::Device& gpu, const SoupBuffers& soup, const BatchBuffers& buffers,
                   const kernels::ViewRecord& record, const gpu::Buffer& counts);

/// What training views show of each triangle.
struct Seen {
  std::vector<std::uint32_t> pixels;  // [T] that it wins over all views together
  std::vector<std::uint32_t> area;   // [T] pixels of a photograph that it would cover, were all of it as large as where
                                     // it is seen largest; 0: nowhere
  std::vector<std::uint32_t> views;  // [T] in which it wins a pixel
};
Seen measure_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views);

/// Per view, one byte per triangle: 1 where it wins a pixel.
std::vector<std::vector<std::uint8_t>> visible_in_each(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                                       std::span<const BatchView> views);

/// If the device says that lists did not fit: makes room, clears the flag and returns the step it was raised in.
/// Waits for the device.
std::optional<std::uint32_t> grow_lists_if_needed(gpu::Device& gpu, BatchBuffers& buffers);

}  // namespace trisoup::train
