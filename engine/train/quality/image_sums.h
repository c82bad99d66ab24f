// PSNR, SSIM, MAE and coverage of renderings that stay on the device.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/quality/image_metrics.h"
#include "train/step/batch_buffers.h"

namespace trisoup::train {

/// Sums over one view, three channels each. Pixels outside the loss mask do not count, and are black in both images for
/// SSIM.
struct ImageSums {
  double absolute = 0, squares = 0;  // of colour errors, 0..1 each
  double ssim = 0;                   // of whole windows; 0 where they were not asked for
  std::uint64_t pixels = 0;          // inside the loss mask
  /// Of those: pixels without a triangle where the photograph differs from the background by more than 8 of 255 in some
  /// channel.
  std::uint64_t uncovered = 0;
  std::uint32_t width = 0, height = 0;
  double share_uncovered() const { return pixels > 0 ? double(uncovered) / double(pixels) : 0.0; }
};

enum class Ssim { none, whole_windows };

/// Compares BatchBuffers::colour with BatchBuffers::target, view by view of the batch in `frame`, whose visible
/// fragments it holds too. Waits for the device.
std::vector<ImageSums> sum_images(gpu::Device& gpu, const BatchBuffers& buffers, const glm::vec3& background,
                                  Ssim ssim);

/// What compare() finds on the host, within 1e-4 dB and an SSIM of 1e-5, and coverage.
ImageMetrics metrics_of(const ImageSums& sums);

}  // namespace trisoup::train
