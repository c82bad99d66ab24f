// What each triangle, and the finest level of its texture, is worth to the pictures of the training views.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Sums of squared colour errors (three channels, 0..1 each) over the pixels of the views that were measured. Each
/// pixel has a weight: half of it 1, as PSNR has it, and half its lack of contrast, as SSIM has it (Wang et al. 2004),
/// since an error on a wall is seen and the same error among leaves is not. The mean weight over a view's loss mask is
/// 1; pixels outside of it have 0.
///
/// Triangles are opaque, so each pixel shows one alone. Two more renderings therefore measure all triangles at once:
/// one of what is behind each, one without the finest levels. Values below zero: the pictures would be better without.
struct Importance {
  double error = 0;                   // of all pixels as they are
  std::vector<std::uint32_t> pixels;  // [T] that show the triangle
  std::vector<double> triangle;       // [T] how much larger the error is without the triangle
  std::vector<double> finest;         // [T] how much larger it is at its pixels with all textures one level coarser
  /// (a triangle, one that its pixels show without it), each pair once, sorted: what the first one's value rests on.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> behind;
};

/// The set of (triangle, triangle behind it) over the pixels of several batches.
class PairSet {
 public:
  PairSet(gpu::Device& gpu, std::uint32_t triangles);
  /// first, behind: [pixels] Hit, of a rendering and of one without the triangles that it shows.
  void add(gpu::Address first, gpu::Address behind, std::uint32_t pixels);
  /// Each once, sorted.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> take() { return std::move(pairs_); }

 private:
  /// A table that is half full still has short ways to a free slot.
  std::uint32_t capacity() const { return slots_ / 2; }
  void make_room(std::uint32_t slots);
  gpu::Device& gpu_;
  std::uint32_t slots_ = 0;
  gpu::Buffer table_, found_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
};

/// views: those to measure, at their own size, with their photographs on the device. exposures: of the photographs;
/// null for none. most: views in a batch. The soup is not changed.
Importance measure_importance(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const glm::vec3& background,
                              std::span<const BatchView> views, const Exposures* exposures, std::size_t most);

}  // namespace trisoup::train
