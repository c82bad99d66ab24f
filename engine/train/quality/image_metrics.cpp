#include "train/quality/image_metrics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/host.h"

namespace trisoup::train {
namespace {

/// Gaussian blur with whole windows only, horizontally, then vertically: [h][w] -> [h - 10][w - 10].
std::vector<double> blur(const std::vector<double>& image, int w, int h) {
  const int ow = w - 10, oh = h - 10;
  std::vector<double> rows(static_cast<std::size_t>(ow) * h), out(static_cast<std::size_t>(ow) * oh);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < ow; ++x) {
      double sum = 0;
      for (int i = 0; i < SSIM_TAPS; ++i) sum += f64::ssim_tap(i) * image[static_cast<std::size_t>(y) * w + x + i];
      rows[static_cast<std::size_t>(y) * ow + x] = sum;
    }
  for (int y = 0; y < oh; ++y)
    for (int x = 0; x < ow; ++x) {
      double sum = 0;
      for (int i = 0; i < SSIM_TAPS; ++i) sum += f64::ssim_tap(i) * rows[static_cast<std::size_t>(y + i) * ow + x];
      out[static_cast<std::size_t>(y) * ow + x] = sum;
    }
  return out;
}

}  // namespace

double psnr_of(double mse) {
  if (!std::isfinite(mse)) return 0.0;
  return mse > 1e-10 ? -10.0 * std::log10(mse) : 100.0;
}

ImageMetrics compare(std::span<const float> colour, const Image& photo) {
  const int w = photo.width, h = photo.height;
  const std::size_t pixels = static_cast<std::size_t>(w) * h;
  ImageMetrics metrics;
  double squares = 0, absolute = 0, ssim = 0;
  std::size_t counted = 0;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> x(pixels), y(pixels), squares_sum(pixels), xy(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
      if (photo.rgba[4 * p + 3] < 128) continue;
      x[p] = std::clamp<double>(colour[3 * p + c], 0.0, 1.0);
      y[p] = photo.rgba[4 * p + c] / 255.0;
      squares_sum[p] = x[p] * x[p] + y[p] * y[p];
      xy[p] = x[p] * y[p];
      const double d = x[p] - y[p];
      squares += d * d;
      absolute += std::abs(d);
      ++counted;
    }
    if (w <= 10 || h <= 10) continue;
    const auto mx = blur(x, w, h), my = blur(y, w, h), ms = blur(squares_sum, w, h), mxy = blur(xy, w, h);
    double sum = 0;
    for (std::size_t i = 0; i < mx.size(); ++i) sum += f64::ssim_window(mx[i], my[i], ms[i], mxy[i]).value;
    ssim += sum / static_cast<double>(mx.size());
  }
  if (counted == 0) return metrics;
  metrics.pixels = counted / 3;
  const double mse = squares / static_cast<double>(counted);
  metrics.psnr = psnr_of(mse);
  metrics.mae = absolute / static_cast<double>(counted);
  metrics.ssim = w > 10 && h > 10 ? ssim / 3 : kNoSsim;
  return metrics;
}

}  // namespace trisoup::train
