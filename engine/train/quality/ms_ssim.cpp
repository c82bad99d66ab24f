#include "train/quality/ms_ssim.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "args/halve.h"
#include "args/ms_ssim.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

constexpr std::size_t kScales = MsSsim::kWeights.size();

std::uint32_t halved(std::uint32_t side) { return (side + 1) / 2; }

}  // namespace

MsSsim::MsSsim(gpu::Device& gpu) : gpu_(gpu), sums_(gpu.allocate(kScales * 3 * 8, "sums of MS-SSIM")) {}

std::optional<double> MsSsim::measure(gpu::Address colour, gpu::Address target, std::uint32_t width,
                                      std::uint32_t height) {
  if (std::min(width, height) < kShortestSide) return std::nullopt;
  std::uint64_t bytes = 0;
  for (std::uint32_t scale = 1, w = halved(width), h = halved(height); scale < kScales;
       ++scale, w = halved(w), h = halved(h))
    bytes += 24ull * w * h;
  if (scales_.bytes() < bytes) scales_ = gpu::Buffer(), scales_ = gpu_.allocate(bytes, "scales of MS-SSIM");
  std::vector<std::uint32_t> zeros;
  for (std::size_t i = 0; i < 3 * kScales; ++i) zeros.insert(zeros.end(), {kFixedZero, 0});
  gpu_.upload(sums_.address(), zeros);

  std::array<double, kScales> windows{};
  gpu::Address shown = colour, wanted = target, next = scales_.address();
  std::uint32_t w = width, h = height;
  for (std::uint32_t scale = 0; scale < kScales; ++scale) {
    const std::uint32_t is_float = scale > 0 ? 1 : 0, last = scale + 1 == kScales ? 1 : 0;
    const gpu::Address bytes_8 = scale == 0 ? wanted : 0, floats = scale == 0 ? 0 : wanted;
    windows[scale] = double(w - 10) * (h - 10);
    gpu_.launch({"ms_ssim", {is_float}}, std::uint64_t((w + 15) / 16) * ((h + 15) / 16),
                kernels::MsSsimArgs{shown, bytes_8, floats, sums_.address() + 24ull * scale, w, h, last, 0});
    if (last != 0) break;
    const std::uint64_t pixels = std::uint64_t(halved(w)) * halved(h);
    gpu_.launch({"halve", {is_float}}, (pixels + 63) / 64,
                kernels::HalveArgs{shown, bytes_8, floats, next, next + 12 * pixels, w, h});
    shown = next, wanted = next + 12 * pixels, next += 24 * pixels;
    w = halved(w), h = halved(h);
  }

  const auto sums = gpu_.download_vector<std::uint32_t>(sums_.address(), 6 * kScales);
  double mean = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double product = 1;
    for (std::size_t scale = 0; scale < kScales; ++scale) {
      const std::size_t at = 2 * (3 * scale + channel);
      const double of_scale = double(IMAGE_SUM_UNIT) * fixed_sum(sums[at], sums[at + 1]) / windows[scale];
      product *= std::pow(std::max(0.0, of_scale), kWeights[scale]);
    }
    mean += product / 3;
  }
  return mean;
}

}  // namespace trisoup::train
