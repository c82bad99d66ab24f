#include "train/quality/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "args/flip_errors.h"
#include "args/flip_rows.h"
#include "base/error.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

constexpr double kPi = std::numbers::pi;

/// A Gaussian of the contrast sensitivity: a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees.
struct Sensitivity {
  double a, b;
  double deviation() const { return std::sqrt(b / (2 * kPi * kPi)); }
  double height() const { return a * std::sqrt(kPi / b); }
};
constexpr Sensitivity kLightness{1, 0.0047}, kRedGreen{1, 0.0053}, kBlueYellow[]{{34.1, 0.04}, {13.5, 0.025}};
constexpr double kFeatureWidth = 0.082;  // degrees
/// The largest error of colours, between green and blue, raised to 0.7: what colour_error() in shaders/common/flip.h
/// scales by.
constexpr double kLargestColourError = 41.276098;

std::vector<double> gaussian(double deviation, std::uint32_t radius) {
  std::vector<double> taps;
  for (int x = -static_cast<int>(radius); x <= static_cast<int>(radius); ++x)
    taps.push_back(std::exp(-x * x / (2 * deviation * deviation)));
  return taps;
}

double sum_of(const std::vector<double>& taps) {
  double sum = 0;
  for (const double tap : taps) sum += tap;
  return sum;
}

/// Divides so that positive taps sum to 1 and negative ones to -1.
void normalise(std::vector<double>& taps) {
  double positive = 0, negative = 0;
  for (const double tap : taps) (tap > 0 ? positive : negative) += std::abs(tap);
  for (double& tap : taps) tap /= tap > 0 ? positive : negative;
}

std::vector<double> normalised(std::vector<double> taps) {
  const double sum = sum_of(taps);
  for (double& tap : taps) tap /= sum;
  return taps;
}

/// Smooth, first and second derivative of a Gaussian, for edges and points.
std::array<std::vector<double>, 3> feature_taps(double deviation, std::uint32_t radius) {
  // These filters end at three deviations of their own.
  const int reach = static_cast<int>(std::ceil(3 * deviation));
  std::vector<double> smooth = gaussian(deviation, radius), first, second;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    const double x = static_cast<double>(i) - radius;
    if (std::abs(x) > reach) smooth[i] = 0;
    first.push_back(-x * smooth[i]);
    second.push_back((x * x / (deviation * deviation) - 1) * smooth[i]);
  }
  normalise(first);
  normalise(second);
  return {normalised(std::move(smooth)), std::move(first), std::move(second)};
}

}  // namespace

Flip::Flip(gpu::Device& gpu, double pixels_per_degree) : gpu_(gpu) {
  if (!(pixels_per_degree >= kFewest && pixels_per_degree <= kMost))
    throw Error("FLIP: {} pixels per degree are not between {} and {}; correct them", pixels_per_degree, kFewest,
                kMost);
  const auto pixels = [&](const Sensitivity& s) { return s.deviation() * pixels_per_degree; };
  radius_ = static_cast<std::uint32_t>(std::ceil(3 * pixels(kBlueYellow[0])));
  std::vector<float> taps;
  const auto add = [&](const std::vector<double>& filter) { taps.insert(taps.end(), filter.begin(), filter.end()); };
  double weight[2];
  for (const Sensitivity* s : {&kLightness, &kRedGreen}) add(normalised(gaussian(pixels(*s), radius_)));
  for (int i = 0; i < 2; ++i) {
    const std::vector<double> filter = gaussian(pixels(kBlueYellow[i]), radius_);
    weight[i] = kBlueYellow[i].height() * sum_of(filter) * sum_of(filter);
    add(normalised(filter));
  }
  blue_share_ = weight[0] / (weight[0] + weight[1]);
  for (const auto& filter : feature_taps(0.5 * kFeatureWidth * pixels_per_degree, radius_)) add(filter);
  taps_ = gpu.allocate(4 * taps.size(), "filters of FLIP");
  gpu.upload(taps_.address(), taps);
  sums_ = gpu.allocate(16, "sums of FLIP");
}

std::optional<double> Flip::measure(gpu::Address colour, gpu::Address target, std::uint32_t width,
                                    std::uint32_t height) {
  pixels_ = std::size_t(width) * height;
  const std::uint32_t band = std::clamp(most_pixels / width, 1u, height);
  const std::uint64_t bytes = 4ull * 2 * FLIP_FILTERS * width * std::min(height, band + 2 * radius_);
  if (rows_.bytes() < bytes) rows_ = gpu::Buffer(), rows_ = gpu_.allocate(bytes, "filtered pictures");
  if (errors_.bytes() < 4 * pixels_) errors_ = gpu::Buffer(), errors_ = gpu_.allocate(4 * pixels_, "errors of FLIP");
  gpu_.upload(sums_.address(), std::vector<std::uint32_t>{kFixedZero, 0, 0, 0});
  for (std::uint32_t first = 0; first < height; first += band) {
    const std::uint32_t last = std::min(height, first + band), from = first - std::min(first, radius_);
    const std::uint32_t rows = std::min(height, last + radius_) - from;
    gpu_.launch({"flip_rows"}, std::uint64_t((width + 63) / 64) * rows,
                kernels::FlipRowsArgs{colour, target, taps_.address(), rows_.address(), width, from, rows, radius_});
    gpu_.launch({"flip_errors"}, std::uint64_t((width + 63) / 64) * (last - first),
                kernels::FlipErrorsArgs{target, taps_.address(), rows_.address(), errors_.address(), sums_.address(),
                                        width, height, from, rows, first, last, radius_,
                                        static_cast<float>(blue_share_), static_cast<float>(kLargestColourError), 0});
    gpu_.cut();
  }
  const auto sums = gpu_.download_vector<std::uint32_t>(sums_.address(), 4);
  if (sums[2] == 0) return std::nullopt;
  return static_cast<double>(IMAGE_SUM_UNIT) * fixed_sum(sums[0], sums[1]) / sums[2];
}

std::vector<float> Flip::error_map() { return gpu_.download_vector<float>(errors_.address(), pixels_); }

}  // namespace trisoup::train
