#include "train/quality/perceptual.h"

namespace trisoup::train {

std::vector<float> Perceptual::measure(gpu::Address colour, gpu::Address target, std::uint32_t width,
                                       std::uint32_t height, ImageMetrics& metrics) {
  metrics.flip = flip_.measure(colour, target, width, height);
  if (metrics.flip) metrics.ms_ssim = ms_ssim_.measure(colour, target, width, height);
  return maps_ ? flip_.error_map() : std::vector<float>{};
}

std::vector<float> Perceptual::measure(const std::vector<float>& colour, const Image& photograph,
                                       ImageMetrics& metrics) {
  if (colour_.bytes() < 4 * colour.size()) {
    colour_ = gpu::Buffer(), target_ = gpu::Buffer();
    colour_ = gpu_.allocate(4 * colour.size(), "rendering");
    target_ = gpu_.allocate(photograph.rgba.size(), "photograph");
  }
  gpu_.upload(colour_.address(), colour);
  gpu_.upload(target_.address(), photograph.rgba);
  return measure(colour_.address(), target_.address(), static_cast<std::uint32_t>(photograph.width),
                 static_cast<std::uint32_t>(photograph.height), metrics);
}

}  // namespace trisoup::train
