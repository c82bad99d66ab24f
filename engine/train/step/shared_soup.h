// A soup that several ranks share (docs/several_machines.md). Each rank owns a range of triangles: it alone has their
// textures, opacities and moments, lists them in tiles and tests them. Every rank has all vertices, the MLP and the
// rendered images.
//
// Results are bit-identical to those of one rank. Minima and fixed-point sums do not depend on the order of their
// terms. Sums for the MLP do, so each workgroup's sum is computed by one rank.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "args/types.h"
#include "gpu/device.h"
#include "ranks/ranks.h"
#include "train/step/batch_buffers.h"
#include "train/step/soup_buffers.h"
#include "train/step/soup_partition.h"
#include "train/step/step.h"

namespace trisoup::train {

/// For each pixel of a batch which rank shades it: whole blocks of 16 x 16, and all that shade_backward.comp sums up in
/// one workgroup. groups: BatchBuffers::mlp_groups. [pixels]
std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks);

/// All ranks make the same calls, in the same order, and get the same results; Step makes most of them.
class SharedSoup : public SoupPartition {
 public:
  /// Makes the soup shared; it must not be allocated yet. All arguments must outlive this object.
  SharedSoup(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, ranks::Ranks& ranks)
      : gpu_(gpu), soup_(soup), buffers_(buffers), ranks_(ranks) {
    soup.partition = this;
  }
  SharedSoup(const SharedSoup&) = delete;
  SharedSoup& operator=(const SharedSoup&) = delete;

  /// Bytes of device memory per pixel of a batch that this object allocates.
  static constexpr std::uint64_t kPixelBytes = 16 + 16 + 32 + 4 + 4 + 36;

  int rank() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  Outcome outcome() const override { return outcome_; }
  bool can_replay() const override { return false; }
  void ask_to_stop(bool stop) override { stop_ = stop; }

  void agree_on_winners() override;  // makes BatchBuffers::hits those of all ranks
  ShadedFrom shaded_from(const ShadedFrom& soup,
                         bool coarser) override;  // features of the pixels that this rank shades
  void share_colours() override;                  // makes BatchBuffers::colour that of all ranks
  ShadedFrom gradients_to(const ShadedFrom&) const override { return stand_in(); }
  void share_gradients() override;  // to BatchBuffers::sorted for own triangles; BatchBuffers::mlp_partial of all ranks

  Parents parents_of(std::span<const std::uint32_t> parents, std::span<const TriangleRange> ranges) const override;
  gpu::Buffer fetch(const Parents& parents, gpu::Buffer pool) override;
  ranks::Bytes gather_on_first(ranks::ByteView mine) override;
  ranks::Bytes scatter_from_first(ranks::ByteView all, std::uint64_t size) override;
  void compare() override;
  /// All parts one after the other on every rank.
  ranks::Bytes all_gather(ranks::ByteView mine);
  /// Values of the source samples of all ranks. [source samples][8]
  std::vector<float> all_values(const gpu::Buffer& pool);
  /// The same on the first rank; empty on the others.
  std::vector<float> gather_values(const gpu::Buffer& pool);

 private:
  /// Stands for the soup where pixels are shaded.
  ShadedFrom stand_in() const;
  /// One pixel of this rank's triangles, before it is known who wins.
  struct Candidate {
    std::uint32_t pixel;
    kernels::Hit hit;
  };
  void place_batch();
  void place_stand_in();
  std::vector<float> own_values(const gpu::Buffer& pool);
  /// Calls visit(pixel, owner of the visible triangle, rank that shades it) for every pixel that shows a triangle, in
  /// ascending order.
  template <typename Visit>
  void each_pixel(Visit&& visit) const;
  void grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what);

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
  ranks::Ranks& ranks_;
  bool stop_ = false;
  Outcome outcome_ = Outcome::done;
  std::vector<std::uint16_t> shaders_;      // [pixels]
  std::vector<std::uint64_t> shaders_for_;  // mlp_groups and sizes of the views for which shaders_ is valid
  std::vector<kernels::Hit> hits_;          // [pixels], nearest over all ranks
  std::vector<std::uint16_t> owners_;       // [pixels], rank that owns the visible triangle
  // Stand-in for the soup when pixels are shaded: each pixel has a texture of one sample, its features.
  gpu::Buffer hits_here_, textures_here_, features_, places_, zeroes_;
  gpu::Buffer gradient_;  // [9][pixels]: gradients of features, by pixel
  std::vector<float> features_here_;
};

}  // namespace trisoup::train
