#include "train/quality/training_fit.h"

#include <cstdint>
#include <numeric>
#include <vector>

#include "base/parallel_for.h"
#include "image/image.h"
#include "train/quality/image_sums.h"
#include "train/step/forward_pass.h"
#include "train/step/step.h"

namespace trisoup::train {
namespace {

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
    result += static_cast<double>(squares[c]) -
              static_cast<double>(sum[c]) * static_cast<double>(sum[c]) / static_cast<double>(count);
  return result / (255.0 * 255.0);
}

}  // namespace

TrainingFit fit_to_training_views(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const scene::Scene& scene,
                                  std::span<const BatchView> views, const Exposures* exposures, std::size_t max_batch) {
  StepInputs inputs;
  inputs.background = scene.background;
  inputs.exposures = exposures;
  inputs.fit_exposures = false;
  Step step(gpu, soup, buffers);
  ImageSums all;
  for_each_batch(gpu, soup, buffers, views, true, inputs, max_batch, [&](std::size_t, std::size_t) {
    step.photographs(inputs);
    for (const ImageSums& view : sum_images(gpu, buffers, scene.background, Ssim::none))
      all.squares += view.squares, all.pixels += view.pixels, all.uncovered += view.uncovered;
  });
  std::vector<double> plain(views.size());
  parallel_for(static_cast<int>(views.size()), 0, [&](int i) {
    plain[static_cast<std::size_t>(i)] =
        squares_around_mean(scene.train[views[static_cast<std::size_t>(i)].index].image);
  });
  const double values = 3.0 * static_cast<double>(all.pixels);
  if (all.pixels == 0) return {100, 100, 0};
  return {psnr_of(all.squares / values), psnr_of(std::accumulate(plain.begin(), plain.end(), 0.0) / values),
          all.share_uncovered()};
}

}  // namespace trisoup::train
