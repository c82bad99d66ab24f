#include "train/training_fit.h"

#include <cmath>
#include <cstdint>

#include "image/image.h"
#include "train/coverage.h"
#include "train/fixed_sum.h"
#include "train/render_pass.h"
#include "train/step.h"

namespace trisoup::train {
namespace {

double psnr_of(double mse) { return mse > 1e-10 ? -10.0 * std::log10(mse) : 100.0; }

/// Sum over pixels and channels of the squared distance from the photograph's mean colour.
double squares_around_mean(const Image& photo) {
  std::uint64_t count = 0, sum[3] = {}, squares[3] = {};
  for (std::size_t p = 0; p < photo.rgba.size(); p += 4) {
    if (photo.rgba[p + 3] < 128) continue;
    ++count;
    for (int c = 0; c < 3; ++c) {
      const std::uint64_t value = photo.rgba[p + static_cast<std::size_t>(c)];
      sum[c] += value;
      squares[c] += value * value;
    }
  }
  double result = 0;
  for (int c = 0; count > 0 && c < 3; ++c)
    result += static_cast<double>(squares[c]) - static_cast<double>(sum[c]) * static_cast<double>(sum[c]) / static_cast<double>(count);
  return result / (255.0 * 255.0);
}

}  // namespace

TrainingFit fit_to_training_views(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene,
                                  std::span<const BatchView> batch, const Exposures* exposures, std::size_t most) {
  StepInputs inputs;
  inputs.background = scene.background;
  inputs.exposures = exposures;
  inputs.fit_exposures = false;
  Step step(gpu, soup, frame);
  Coverage coverage;
  double model = 0, plain = 0, values = 0;
  for_each_batch(gpu, soup, frame, batch, true, inputs, most, [&](std::size_t first, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) coverage.add(coverage_of(gpu, frame, frame.batch().records[i], scene.train[first + i].image, scene.background));
    step.begin(0, 0, 0, {});
    step.loss(inputs);
    const auto sums = gpu.download_vector<kernels::Statistics>(frame.statistics.address(), 1)[0];
    model += fixed_sum(sums.mse_low, sums.mse_high) * 3.0 * frame.batch().pixels;
  });
  for (const scene::View& view : scene.train) {
    plain += squares_around_mean(view.image);
    values += 3.0 * view.camera.width * view.camera.height;
  }
  return {psnr_of(model / values), psnr_of(plain / values), coverage.share()};
}

}  // namespace trisoup::train
