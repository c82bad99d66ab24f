// A soup that several ranks share (docs/several_machines.md). Each owns some triangles: it lists and tests them, and
// has their textures, opacities and moments, alone. Vertices, MLP and pictures are with every rank. The bits are those
// of one rank: a minimum and sums in fixed point do not know who made their terms, and the MLP's sums, which do depend
// on an order, are made by blocks of the picture that are whole with one rank.
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

/// Whose triangles are whose: a range of their numbers for each rank, of about as many bytes. [ranks]
std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks);

/// For each pixel of a batch which rank shades it: whole blocks of 16 x 16, and all that shade_backward.comp sums up in
/// one workgroup. groups: BatchBuffers::mlp_groups. [pixels]
std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks);

/// All ranks make the same calls, in the same order, and find the same; Step makes most of them.
class SharedSoup {
 public:
  /// The soup becomes shared, before it is allocated. All must outlive this object.
  SharedSoup(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, ranks::Ranks& ranks)
      : gpu_(gpu), soup_(soup), buffers_(buffers), ranks_(ranks) {
    soup.shared = this;
  }
  SharedSoup(const SharedSoup&) = delete;
  SharedSoup& operator=(const SharedSoup&) = delete;

  /// Device memory that it takes for each pixel of a batch.
  static constexpr std::uint64_t kPixelBytes = 16 + 16 + 32 + 4 + 4 + 36;

  int rank() const { return ranks_.rank(); }
  int size() const { return ranks_.size(); }
  bool is_first() const { return ranks_.is_first(); }

  enum class Outcome {
    done,
    overflow,  // tile lists of some rank did not fit: nothing has changed, and it is to be done again
    stopped    // a rank was asked to stop: nothing has changed
  };
  /// Of the last Step::visibility().
  Outcome outcome() const { return outcome_; }
  /// Whether this rank is asked to stop: all learn of it in the next Step::visibility().
  void ask_to_stop(bool stop) { stop_ = stop; }

  // Parts of a step, of the batch in the frame.
  void agree_on_winners();  // BatchBuffers::hits, of all ranks
  ShadedFrom fetch_features(
      bool coarser = false);    // of the pixels that this rank shades; coarser: without textures' finest levels
  void send_colours();          // BatchBuffers::colour, of all ranks
  ShadedFrom stand_in() const;  // the same as fetch_features() returned
  void send_gradients();        // to BatchBuffers::sorted, of own triangles; BatchBuffers::mlp_partial, of all ranks

  /// Triangles of this soup that those of a new one are made of.
  struct Parents {
    std::vector<std::vector<std::uint32_t>> needed;  // by each rank, ascending, each once. [ranks]
    std::vector<kernels::Texture> rows;  // texture table of those that this rank needs, in pools by themselves
    std::vector<std::uint32_t> numbers;  // for each of its new triangles: its parent's row. [range]
    std::uint64_t samples = 0;           // in such a pool
  };
  /// parents: of every triangle of the new soup, which is divided as `ranges` say.
  Parents parents_of(std::span<const std::uint32_t> parents, std::span<const TriangleRange> ranges) const;
  /// Samples that this rank needs, of a pool (source or a moment) of which each has its own triangles' part. That part
  /// goes before the samples come.
  gpu::Buffer fetch(const Parents& parents, gpu::Buffer pool);

  /// Bytes that each rank has a part of, one after the other: on the first rank, and nothing on the others.
  ranks::Bytes gather_on_first(ranks::ByteView mine);
  /// Of bytes that the first rank has, `size` for each sample of the lattices of all triangles: those of own triangles.
  ranks::Bytes scatter_from_first(ranks::ByteView all, std::uint64_t size);
  /// The same on every rank.
  ranks::Bytes on_all(ranks::ByteView mine);
  /// Values of source samples of all ranks. [source samples][8]
  std::vector<float> all_values(const gpu::Buffer& pool);
  std::vector<float> gather_values(const gpu::Buffer& pool);

  /// Throws Error where what all ranks compute, vertices and MLP, has come out differently.
  void compare();

 private:
  /// One pixel of this rank's triangles, before it is known who wins.
  struct Candidate {
    std::uint32_t pixel;
    kernels::Hit hit;
  };
  void place_batch();
  void place_stand_in();
  std::vector<float> own_values(const gpu::Buffer& pool);
  /// Calls visit(pixel, rank that owns what it shows, rank that shades it) for every pixel that shows a triangle, in
  /// order.
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
  std::vector<std::uint64_t> shaders_for_;  // the sizes of the views that shaders_ is of
  std::vector<kernels::Hit> hits_;          // [pixels], of all ranks
  std::vector<std::uint16_t> owners_;       // [pixels], of what they show
  // What stands for the soup where pixels are shaded: of each pixel a texture of one sample that is its features.
  gpu::Buffer hits_here_, textures_here_, features_, places_, zeroes_;
  gpu::Buffer gradient_;  // [9][pixels]: of the features, by pixel
  std::vector<float> features_here_;
};

}  // namespace trisoup::train
