// Device memory for one batch of views: what is computed anew in every step.
#pragma once

#include <cstdint>
#include <span>

#include "gpu/device.h"
#include "train/step/batch_view.h"

namespace trisoup::train {

class BatchBuffers {
 public:
  static constexpr std::uint32_t kStatisticsRows = 256;  // steps whose sums are kept

  /// mlp_groups: workgroups over which shade_backward splits a batch; 0: what suits the device.
  BatchBuffers(gpu::Device& gpu, std::uint32_t mlp_groups = 0);

  /// Makes room for batches of up to `views` views, `pixels` pixels in all and `triangles` triangles. Buffers only
  /// grow.
  void reserve(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles, bool training);

  /// Takes a batch whose records the device has or will get; reserves what it needs.
  void place(const BatchLayout& batch, std::uint32_t triangles, bool training);
  /// Places a batch and uploads its records.
  void set_batch(std::span<const BatchView> views, std::uint32_t triangles, bool training);
  const BatchLayout& batch() const { return batch_; }

  /// Lets the tiles' lists hold `entries` triangles, all tiles of a band together.
  void reserve_lists(std::uint64_t entries);
  /// Makes room for lists of `peak` entries: longer ones, or more bands.
  void make_room(std::uint32_t peak);
  /// Into how many bands of tiles the batch is cut. Each is a submission.
  std::uint32_t bands() const;
  std::uint32_t list_capacity() const { return static_cast<std::uint32_t>(lists.bytes() / 4); }

  /// Bound of one submission, so that no watchdog (Windows and amdgpu: 2 s) ends it: a band has at most kMostPairs
  /// pairs of a tile and a triangle to compare, and most_entries = kMostPairs / 64 entries in its tiles' lists, each of
  /// 64 pairs of a pixel and a triangle, unless a single tile has more. Kernels over more than kMostPixels pixels have
  /// submissions of their own.
  static constexpr std::uint64_t kMostPairs = 1ull << 30;
  static constexpr std::uint32_t kMostPixels = 1u << 23;
  std::uint64_t most_entries = kMostPairs / 64;  // tests lower it

  gpu::Buffer views, screen, counts, offsets, lists, hits, colour, target, gradient, partial, same, mlp_partial,
      image_sums, statistics, state, control;
  gpu::Buffer shown,
      ranks;  // pixels of each triangle and their places (place_pixels); number of each pixel among its triangle's
  /// [9][pixels]: gradients of the features and barycentrics of the pixels, sorted by triangle. The SSIM derivatives
  /// are no longer needed then.
  gpu::Address sorted() const { return partial.address(); }
  std::uint32_t mlp_groups;
  bool wide_textures;  // large textures have workgroups of 256 threads; what suits the device
  bool one_pixel;  // a thread shades one pixel after the other (shaders/common/pixel_lanes.h); what suits the device

 private:
  void grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what);
  gpu::Device& gpu_;
  BatchLayout batch_;
  std::uint32_t triangles_ = 0;
  std::uint32_t bands_ = 1;  // that the lists need
};

/// Bytes that BatchBuffers::reserve takes for such batches.
std::uint64_t batch_bytes(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                          bool training);

}  // namespace trisoup::train
