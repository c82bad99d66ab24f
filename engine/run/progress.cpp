#include "run/progress.h"

#include <algorithm>
#include <cmath>

#include "common/host.h"
#include "train/quality/image_metrics.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {

Progress read_progress(gpu::Device& gpu, const BatchBuffers& buffers, TrainingViews& views, std::uint64_t first,
                       std::uint64_t last) {
  constexpr std::uint64_t kRows = BatchBuffers::kStatisticsRows;
  const auto rows = gpu.download_vector<kernels::Statistics>(buffers.statistics.address(), kRows);
  Progress p;
  p.step = last;
  double mse = 0, measured = 0;
  const std::uint64_t count = std::min<std::uint64_t>(last - first, kRows);
  for (std::uint64_t s = last - count; s < last; ++s) {
    const kernels::Statistics& r = rows[s % kRows];
    p.l1 += fixed_sum(r.l1_low, r.l1_high);
    p.ssim += fixed_sum(r.ssim_low, r.ssim_high);
    mse += fixed_sum(r.mse_low, r.mse_high);
    measured += views.has_pixels(s);
  }
  const double n = std::max<double>(1.0, static_cast<double>(count));
  p.l1 /= n;
  p.ssim /= n;
  p.loss = LOSS_L1 * p.l1 + LOSS_SSIM * (1.0 - p.ssim);
  if (measured > 0) p.psnr = psnr_of(mse / measured);
  return p;
}

}  // namespace trisoup::train
