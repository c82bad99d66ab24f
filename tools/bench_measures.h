// soup-bench measures: what PSNR, SSIM, MS-SSIM and FLIP of a view cost, beside rendering it.
#pragma once

#include <cstdint>
#include <string>

#include "gpu/device.h"

namespace trisoup::bench {

struct MeasuresOptions {
  std::uint32_t side = 800, triangles = 15000;  // views have side x side pixels
  int repeats = 5;
  std::string json;  // output file; empty: none
};

/// Prints milliseconds per view of an evaluation and of each measure alone, medians. Throws Error.
void measures(gpu::Device& gpu, const MeasuresOptions& options);

}  // namespace trisoup::bench
