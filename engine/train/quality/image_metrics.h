// PSNR, SSIM and MAE of a rendering against a photograph, computed on the host in double precision. For images on the
// host, and as the reference of image_sums.h.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include "image/image.h"

namespace trisoup::train {

/// SSIM of a picture that has no whole window: not a number, and null in JSON.
inline constexpr double kNoSsim = std::numeric_limits<double>::quiet_NaN();

struct ImageMetrics {
  double psnr = 0;         // dB, peak 1; 100 if there is no error
  double ssim = 0;         // 11-tap Gaussian, sigma 1.5, whole windows only (Wang et al. 2004); or kNoSsim
  double mae = 0;          // mean |difference|, 0..1
  std::size_t pixels = 0;  // number compared; if 0, the other values are meaningless
  /// Share of the pixels without a triangle where the photograph differs from the background; 0 from compare(), which
  /// does not know the triangles, and not a number from evaluate_renderer().
  double uncovered = 0;
  /// Measured by Perceptual (perceptual.h) alone. ms_ssim: nothing if the picture is too small, too.
  std::optional<double> ms_ssim = {}, flip = {};
};

/// PSNR in dB for a peak of 1; 100 if there is no error, 0 if the error is not finite.
double psnr_of(double mean_squared_error);

/// colour: [height][width][3], clamped to 0..1. Pixels outside the photograph's mask are ignored by PSNR and MAE, and
/// black in both images for SSIM. All values are 0 if the mask is empty.
ImageMetrics compare(std::span<const float> colour, const Image& photograph);

}  // namespace trisoup::train
