// Device memory for one batch of views: what is computed anew in every step.
#pragma once

#include <cstdint>
#include <span>

#include "gpu/device.h"
#include "train/view_record.h"

namespace trisoup::train {

class Frame {
 public:
  static constexpr std::uint32_t kStatisticsRows = 256;  // steps whose sums are kept

  /// mlp_groups: workgroups over which shade_backward splits a batch; 0: what suits the device.
  Frame(gpu::Device& gpu, std::uint32_t mlp_groups = 0);

  /// Makes room for batches of up to `views` views, `pixels` pixels in all and `triangles` triangles. Buffers only grow.
  void reserve(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles, bool training);

  /// Uploads the records of a batch; reserves what it needs.
  void set_batch(std::span<const BatchView> views, std::uint32_t triangles, bool training);
  const BatchLayout& batch() const { return batch_; }

  /// Lets the tiles' lists hold `entries` triangles, all tiles together.
  void reserve_lists(std::uint64_t entries);
  std::uint32_t list_capacity() const { return static_cast<std::uint32_t>(lists.bytes() / 4); }

  gpu::Buffer views, screen, counts, offsets, lists, hits, colour, gradient, partial, same, mlp_partial, statistics, state, control;
  std::uint32_t mlp_groups;

 private:
  void grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what);
  gpu::Device& gpu_;
  BatchLayout batch_;
};

/// Bytes that Frame::reserve takes for such batches.
std::uint64_t frame_bytes(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                          bool training);

}  // namespace trisoup::train
