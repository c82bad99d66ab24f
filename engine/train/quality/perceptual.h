// MS-SSIM and FLIP of rendered views beside the metrics of image_metrics.h.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/quality/flip.h"
#include "train/quality/image_metrics.h"
#include "train/quality/ms_ssim.h"

namespace trisoup::train {

/// Called with FLIP's errors of each view, after it was shown. errors: [height][width], 0..1; 0 outside the mask.
using OnErrors = std::function<void(const scene::View& view, const std::vector<float>& errors)>;

/// Whether an evaluation measures MS-SSIM and FLIP, and how.
struct PerceptualOptions {
  bool wanted = false;
  double pixels_per_degree = Flip::kPixelsPerDegree;
  OnErrors on_errors = {};
};

class Perceptual {
 public:
  /// Throws Error as Flip does.
  Perceptual(gpu::Device& gpu, const PerceptualOptions& options)
      : gpu_(gpu), flip_(gpu, options.pixels_per_degree), ms_ssim_(gpu), maps_(static_cast<bool>(options.on_errors)) {}

  /// Adds ms_ssim and flip of pictures on the device to `metrics`, unless they have no pixels to compare; arguments as
  /// of Flip::measure(). Returns the errors if options.on_errors is set. Throws gpu::OutOfMemory.
  std::vector<float> measure(gpu::Address colour, gpu::Address target, std::uint32_t width, std::uint32_t height,
                             ImageMetrics& metrics);

  /// The same for pictures on the host; arguments as of compare().
  std::vector<float> measure(const std::vector<float>& colour, const Image& photograph, ImageMetrics& metrics);

 private:
  gpu::Device& gpu_;
  Flip flip_;
  MsSsim ms_ssim_;
  bool maps_;
  gpu::Buffer colour_, target_;  // of pictures on the host
};

}  // namespace trisoup::train
