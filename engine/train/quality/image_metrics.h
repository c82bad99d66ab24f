// PSNR, SSIM and MAE of a rendering against a photograph, in double on the host: the reference of image_sums.h, and for
// pictures that are there.
#pragma once

#include <cstddef>
#include <span>

#include "image/image.h"

namespace trisoup::train {

struct ImageMetrics {
  double psnr = 0;  // dB, peak 1; 100 where there is no error at all
  double ssim = 0;  // 11-tap Gaussian, sigma 1.5, whole windows only (Wang et al. 2004); 1 where the image is smaller
  double mae = 0;   // mean |difference|, 0..1
  std::size_t pixels = 0;  // that took part; without one the others say nothing
  double uncovered =
      0;  // share of the pixels where no triangle is seen and the photograph shows something; compare() cannot tell: 0
};

/// PSNR in dB for a peak of 1; 100 where there is no error.
double psnr_of(double mean_squared_error);

/// colour: [height][width][3], clamped to 0..1. Pixels masked out of the photograph do not count for PSNR and MAE and
/// are black in both images for SSIM. Of none all is 0.
ImageMetrics compare(std::span<const float> colour, const Image& photograph);

}  // namespace trisoup::train
