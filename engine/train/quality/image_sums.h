// PSNR, SSIM, MAE and coverage of renderings, computed on the device.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/quality/image_metrics.h"
#include "train/step/batch_buffers.h"

namespace trisoup::train {

/// Sums over the pixels and the three channels of one view. Pixels outside the loss mask are ignored, and black in both
/// images for SSIM.
struct ImageSums {
  double absolute = 0, squares = 0;  // of colour errors, 0..1 each
  double ssim = 0;                   // of `windows` whole windows; 0 if not requested
  std::uint64_t pixels = 0;          // inside the loss mask
  /// Pixels among them without a triangle where the photograph differs from the background by more than 8 / 255 in any
  /// channel.
  std::uint64_t uncovered = 0;
  std::uint64_t windows = 0;  // complete SSIM windows; 0 if the image is too small for one
  double share_uncovered() const { return pixels > 0 ? double(uncovered) / double(pixels) : 0.0; }
};

enum class Ssim : std::uint32_t {
  none = 0,
  whole_windows = 1,    // all
  centred_in_mask = 2,  // those whose central pixel is inside the loss mask
};

/// Compares BatchBuffers::colour with BatchBuffers::target for each view of the batch. `buffers` must also hold its
/// visible fragments. Waits for the device. [views]
std::vector<ImageSums> sum_images(gpu::Device& gpu, const BatchBuffers& buffers, const glm::vec3& background,
                                  Ssim ssim);

/// The same metrics as compare() on the host, to within 1e-4 dB and an SSIM of 1e-5, and coverage.
ImageMetrics metrics_of(const ImageSums& sums);

}  // namespace trisoup::train
