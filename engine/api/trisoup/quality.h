// Measures of renderings against photographs.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

namespace trisoup {

struct Quality {
  double psnr = 0;       // dB
  double ssim = 0;       // 11-tap Gaussian window (Wang et al. 2004)
  double mae = 0;        // mean absolute difference, 0 to 1
  double uncovered = 0;  // share of the pixels without a triangle where the photograph differs from the background
  // Not a number where not measured: during a training; MS-SSIM also if a side has fewer than 161 pixels.
  double ms_ssim = std::numeric_limits<double>::quiet_NaN();  // five scales (Wang et al. 2003)
  double flip = std::numeric_limits<double>::quiet_NaN();     // at 67 pixels per degree (Andersson et al. 2020)
  // Where at least two training views show the surface unhidden. Not a number during a training, of training views, and
  // PSNR and SSIM below 1 % of the pixels.
  double covisible = std::numeric_limits<double>::quiet_NaN();       // share of the pixels, 0 to 1 (Gao et al. 2022)
  double psnr_covisible = std::numeric_limits<double>::quiet_NaN();  // dB
  double ssim_covisible = std::numeric_limits<double>::quiet_NaN();
};

struct ViewQuality {
  std::string name;  // of the view
  Quality quality;
  bool measured = true;  // false: its mask excludes every pixel, and all measures are 0
};

struct Evaluation {
  std::vector<ViewQuality> views;
  Quality mean;  // over the measured views
};

/// Name, member and meaning of a measure.
struct Measure {
  const char* name;
  double Quality::*member;
  const char* help;
};
/// All measures.
std::span<const Measure> measures();

}  // namespace trisoup
