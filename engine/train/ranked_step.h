// A training step that several ranks do together (docs/several_machines.md). Each owns some triangles: it lists and tests them, and
// their textures, opacities and moments are updated by it alone. Vertices, MLP and pictures are with every rank. The bits are those of
// one rank: a minimum and sums in fixed point do not know who made their terms, and the MLP's sums, which do depend on an order, are
// made by blocks of the picture that are whole with one rank.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "args/types.h"
#include "gpu/device.h"
#include "ranks/ranks.h"
#include "train/frame.h"
#include "train/soup_buffers.h"
#include "train/step.h"

namespace trisoup::train {

/// Whose triangles are whose: a range of their numbers for each rank, of about as many bytes. [ranks]
std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks);

/// For each pixel of a batch which rank shades it: whole blocks of 16 x 16, and all that shade_backward.comp sums up in one workgroup.
/// groups: Frame::mlp_groups. [pixels]
std::vector<std::uint16_t> shaders_of(const BatchLayout& batch, std::uint32_t groups, int ranks);

class RankedStep {
 public:
  RankedStep(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, ranks::Ranks& ranks) : gpu_(gpu), soup_(soup), frame_(frame), ranks_(ranks) {}

  enum class Outcome {
    done,
    overflow,  // tile lists of some rank did not fit: nothing has changed, and the step is to be done again
    stopped    // a rank was asked to stop: nothing has changed
  };
  /// Step::train() of the batch in the frame, after its state has begun. stop: whether this rank is asked to stop.
  Outcome train(const StepInputs& inputs, bool stop);

  /// Brings the textures of all ranks to every rank, and with `moments` their optimiser state; before anything but a step looks at
  /// them. What has not changed since is not sent again. Throws Error where what all ranks compute has come out differently.
  void gather(bool moments);
  /// The soup has another topology, of which every rank has all: triangles are divided anew.
  void divide() { ranges_.clear(); }

 private:
  /// One pixel of this rank's triangles, before it is known who wins.
  struct Candidate {
    std::uint32_t pixel;
    kernels::Hit hit;
  };
  TriangleRange own() const { return ranges_[static_cast<std::size_t>(ranks_.rank())]; }
  void divide_if_needed();
  void compare();
  void place_batch();
  Outcome agree_on_winners(bool stop);
  void send_features();
  void send_colours();
  void send_gradients();
  /// Calls visit(pixel, rank that owns what it shows, rank that shades it) for every pixel that shows a triangle, in order.
  template <typename Visit>
  void each_pixel(Visit&& visit) const;
  void grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what);
  void gather(gpu::Buffer& buffer);
  ShadedFrom stand_in() const;

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  Frame& frame_;
  ranks::Ranks& ranks_;
  std::vector<TriangleRange> ranges_;    // [ranks]; empty: to be divided
  std::vector<std::uint16_t> owners_;    // [T]
  std::vector<std::uint16_t> shaders_;   // [pixels]
  std::vector<std::uint64_t> shaders_for_;  // the sizes of the views that shaders_ is of
  std::vector<kernels::Hit> hits_;       // [pixels], of all ranks
  // What stands for the soup where pixels are shaded: of each pixel a texture of one sample that is its features.
  gpu::Buffer hits_here_, textures_here_, features_, places_, zeroes_;
  gpu::Buffer gradient_;                 // [9][pixels]: of the features, by pixel
  std::vector<float> features_here_;
  bool textures_sent_ = false, moments_sent_ = false;
};

}  // namespace trisoup::train
