#include "train/quality/image_sums.h"

#include "args/image_metrics.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {

std::vector<ImageSums> sum_images(gpu::Device& gpu, const BatchBuffers& buffers, const glm::vec3& background,
                                  Ssim ssim) {
  const BatchLayout& batch = buffers.batch();
  kernels::ImageSums empty{};
  empty.l1_low = empty.mse_low = empty.ssim_low = kFixedZero;
  const gpu::Address rows = buffers.image_sums.address();
  gpu.upload(rows, std::vector<kernels::ImageSums>(batch.views, empty));
  gpu.launch({"image_metrics", {static_cast<std::uint32_t>(ssim)}}, batch.blocks,
             kernels::ImageMetricsArgs{buffers.views.address(), buffers.hits.address(), buffers.colour.address(),
                                       buffers.target.address(), 0, rows, batch.views, batch.blocks, background.r,
                                       background.g, background.b, 0});
  const auto unit = static_cast<double>(IMAGE_SUM_UNIT);
  std::vector<ImageSums> sums;
  for (const kernels::ImageSums& row : gpu.download_vector<kernels::ImageSums>(rows, batch.views)) {
    sums.push_back({unit * fixed_sum(row.l1_low, row.l1_high), unit * fixed_sum(row.mse_low, row.mse_high),
                    unit * fixed_sum(row.ssim_low, row.ssim_high), row.pixels, row.uncovered, row.windows});
  }
  return sums;
}

ImageMetrics metrics_of(const ImageSums& sums) {
  ImageMetrics metrics;
  if (sums.pixels == 0) return metrics;
  const double values = 3.0 * static_cast<double>(sums.pixels);
  metrics.pixels = sums.pixels;
  metrics.psnr = psnr_of(sums.squares / values);
  metrics.mae = sums.absolute / values;
  metrics.ssim = sums.windows > 0 ? sums.ssim / (3.0 * static_cast<double>(sums.windows)) : kNoSsim;
  metrics.uncovered = sums.share_uncovered();
  return metrics;
}

}  // namespace trisoup::train
