// Importance of each triangle, and of the finest level of its texture, for the training views.
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

/// Sums of squared colour errors (three channels, 0..1 each) over the pixels of the measured views. Half of a pixel's
/// weight is uniform, as in PSNR. The other half falls with the local contrast, as in SSIM (Wang et al. 2004), because
/// errors are more visible on a plain wall than among leaves. The mean weight over a view's loss mask is 1. Pixels
/// outside it have weight 0.
///
/// Triangles are opaque, so each pixel shows exactly one. Two more renderings therefore measure all triangles at once:
/// one shows what is behind each triangle, the other omits the finest levels. A negative value means that the images
/// would be better without the triangle or level.
struct Importance {
  double error = 0;                   // of all pixels, with all triangles
  std::vector<std::uint32_t> pixels;  // [T] number of pixels that show the triangle
  std::vector<double> triangle;       // [T] increase of the error without the triangle
  std::vector<double> finest;         // [T] increase of the error at its pixels if all textures are one level coarser
  /// Pairs (triangle, a triangle that its pixels show without it), unique and sorted. The value of the first assumes
  /// that the second stays.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> behind;
};

/// The set of pairs (triangle, triangle behind it) over the pixels of several batches.
class PairSet {
 public:
  PairSet(gpu::Device& gpu, std::uint32_t triangles);
  /// first, behind: [pixels] Hit of a rendering and of one without the triangles that the first shows. Waits for the
  /// device.
  void add(gpu::Address first, gpu::Address behind, std::uint32_t pixels);
  /// The pairs, unique and sorted. Leaves the set empty.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> take() { return std::move(pairs_); }

 private:
  /// Pairs that the hash table may hold: half of its slots, so that probing stays short.
  std::uint32_t capacity() const { return slots_ / 2; }
  void make_room(std::uint32_t slots);
  gpu::Device& gpu_;
  std::uint32_t slots_ = 0;
  gpu::Buffer table_, found_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
};

/// Measures the importance of all triangles of `soup`. views: at full size, with their photographs on the device.
/// exposures: of the photographs; null for none. max_batch: largest number of views in a batch.
Importance measure_importance(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const glm::vec3& background,
                              std::span<const BatchView> views, const Exposures* exposures, std::size_t max_batch);

}  // namespace trisoup::train
