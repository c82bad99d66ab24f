// Device buffers for one batch of views. Every step computes their contents anew.
#pragma once

#include <cstdint>
#include <span>

#include "gpu/device.h"
#include "train/step/batch_view.h"

namespace trisoup::train {

class BatchBuffers {
 public:
  static constexpr std::uint32_t kStatisticsRows = 256;  // number of steps whose loss sums are kept

  /// mlp_groups: number of workgroups among which shade_backward divides a batch; 0: a default for the kind of device.
  BatchBuffers(gpu::Device& gpu, std::uint32_t mlp_groups = 0);

  /// Allocates buffers for batches of up to `views` views with `pixels` pixels and `tiles` tiles in total, of a soup of
  /// `triangles` triangles. training: also allocates the buffers of the backward pass. Buffers never shrink.
  void reserve(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles, bool training);

  /// Sets the batch and allocates its buffers. Does not upload the view records: StepQueue or the caller does.
  void place(const BatchLayout& batch, std::uint32_t triangles, bool training);
  /// Lays out the views as a batch, calls place() and uploads the view records.
  void set_batch(std::span<const BatchView> views, std::uint32_t triangles, bool training);
  const BatchLayout& batch() const { return batch_; }

  /// Allocates tile lists of `entries` triangles, shared by all tiles of a band.
  void reserve_lists(std::uint64_t entries);
  /// Enlarges the tile lists for `peak` entries. If that would exceed most_entries, increases the number of bands.
  void make_room(std::uint32_t peak);
  /// Number of bands of tiles into which the batch is divided. Each band is a submission of its own.
  std::uint32_t bands() const;
  std::uint32_t list_capacity() const { return static_cast<std::uint32_t>(lists.bytes() / 4); }

  /// Limits of one submission, so that no watchdog (2 s on Windows and with amdgpu) stops it. A band compares at most
  /// kMostPairs pairs of a tile and a triangle. Its tile lists have at most most_entries = kMostPairs / 64 entries,
  /// each of which is 64 pairs of a pixel and a triangle. A single tile may exceed this. Kernels over more than
  /// kMostPixels pixels run in submissions of their own.
  static constexpr std::uint64_t kMostPairs = 1ull << 30;
  static constexpr std::uint32_t kMostPixels = 1u << 23;
  std::uint64_t most_entries = kMostPairs / 64;  // tests use less

  gpu::Buffer views, screen, counts, offsets, lists, hits, colour, target, gradient, partial, same, mlp_partial,
      image_sums, statistics, state, control;
  /// shown: each triangle's number of visible pixels, a counter, and each triangle's first position in sorted()
  /// (place_pixels). [T], [1], [T]
  /// ranks: index of each pixel among the pixels of its triangle. [pixels]
  gpu::Buffer shown, ranks;
  /// [9][pixels]: gradients of the pixels' features and barycentrics, sorted by triangle. They replace the SSIM
  /// derivatives, which are no longer needed by then.
  gpu::Address sorted() const { return partial.address(); }
  std::uint32_t mlp_groups;
  bool wide_textures;  // updates large textures with workgroups of 256 threads; default: on GPUs
  bool one_pixel;      // a thread shades one pixel at a time (shaders/common/pixel_lanes.h); default: by device

 private:
  void grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what);
  gpu::Device& gpu_;
  BatchLayout batch_;
  std::uint32_t triangles_ = 0;
  std::uint32_t bands_ = 1;  // number that the tile lists need
};

/// Bytes that BatchBuffers::reserve allocates for batches of these sizes.
std::uint64_t batch_bytes(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                          bool training);

}  // namespace trisoup::train
