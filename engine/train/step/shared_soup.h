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
#include "train/step/step.h"

namespace trisoup::train {

/// Divides the triangles into ranges of about equal memory, one per rank. [ranks]
std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks);

/// The rank that shades each pixel of a batch. All pixels of a 16 x 16 block, and of all blocks that one workgroup of
/// shade_backward.comp sums, have the same rank. groups: BatchBuffers::mlp_groups. [pixels]
std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks);

/// All ranks must make the same calls in the same order, and get the same results. Step makes most of the calls.
class SharedSoup {
 public:
  /// Marks the soup as shared. It must not be allocated yet. The arguments must outlive this object.
  SharedSoup(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, ranks::Ranks& ranks)
      : gpu_(gpu), soup_(soup), buffers_(buffers), ranks_(ranks) {
    soup.shared = this;
  }
  SharedSoup(const SharedSoup&) = delete;
  SharedSoup& operator=(const SharedSoup&) = delete;

  /// Bytes of device memory per pixel of a batch that this object allocates.
  static constexpr std::uint64_t kPixelBytes = 16 + 16 + 32 + 4 + 4 + 36;

  int rank() const { return ranks_.rank(); }
  int size() const { return ranks_.size(); }
  bool is_first() const { return ranks_.is_first(); }

  enum class Outcome {
    done,
    overflow,  // tile lists of a rank overflowed; nothing has changed; enlarge them and try again
    stopped    // a rank was asked to stop; nothing has changed
  };
  /// Of the last Step::visibility().
  Outcome outcome() const { return outcome_; }
  /// stop: whether this rank is asked to stop. If one is, the next Step::visibility() ends in `stopped` on all ranks.
  void ask_to_stop(bool stop) { stop_ = stop; }

  // Parts of a step, for the current batch.

  /// Replaces BatchBuffers::hits by the nearest fragments of all ranks.
  void agree_on_winners();
  /// Fetches the features of the pixels that this rank shades from the owners of their triangles. coarser: from
  /// textures without their finest level. Returns stand_in().
  ShadedFrom fetch_features(bool coarser = false);
  /// Exchanges the pixels that each rank has shaded: BatchBuffers::colour becomes complete.
  void send_colours();
  /// The buffers that replace those of the soup when pixels are shaded.
  ShadedFrom stand_in() const;
  /// Sends gradients of features to the owners of the triangles, where they go to BatchBuffers::sorted(), and exchanges
  /// the rows of BatchBuffers::mlp_partial.
  void send_gradients();

  /// The triangles of this soup from which the triangles of a new soup inherit their textures.
  struct Parents {
    std::vector<std::vector<std::uint32_t>> needed;  // by each rank, ascending and unique. [ranks]
    std::vector<kernels::Texture> rows;              // texture table of those that this rank needs, for fetch()'s pool
    std::vector<std::uint32_t> numbers;              // row of the parent of each of this rank's new triangles. [range]
    std::uint64_t samples = 0;                       // in fetch()'s pool
  };
  /// parents: of every triangle of the new soup. ranges: the division of the new soup. [ranks]
  Parents parents_of(std::span<const std::uint32_t> parents, std::span<const TriangleRange> ranges) const;
  /// Fetches the samples that this rank needs of a pool (source or a moment), of which each rank has the part of its
  /// own triangles. Frees `pool` before it allocates the result.
  gpu::Buffer fetch(const Parents& parents, gpu::Buffer pool);

  /// The parts of all ranks, in order of rank, on the first rank; empty on the others.
  ranks::Bytes gather_on_first(ranks::ByteView mine);
  /// Distributes `all`, which only the first rank has: `size` bytes per lattice sample of all triangles. Returns the
  /// part of own triangles.
  ranks::Bytes scatter_from_first(ranks::ByteView all, std::uint64_t size);
  /// The parts of all ranks, in order of rank, on every rank.
  ranks::Bytes on_all(ranks::ByteView mine);
  /// Values of the source samples of all triangles (source or a moment), on every rank. [source samples][8]
  std::vector<float> all_values(const gpu::Buffer& pool);
  /// The same on the first rank; empty on the others.
  std::vector<float> gather_values(const gpu::Buffer& pool);

  /// Throws Error if vertices or MLP, which every rank computes, differ between ranks.
  void compare();

 private:
  /// The nearest fragment of this rank's triangles in one pixel.
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
