#include "bench_measures.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/machine.h"
#include "bench_ball.h"
#include "cli/output_text.h"
#include "revision.h"
#include "train/quality/evaluate.h"
#include "train/quality/image_sums.h"
#include "train/step/batch_buffers.h"
#include "train/step/forward_pass.h"
#include "train/step/step.h"

namespace trisoup::bench {
namespace {

/// Views with photographs of noise.
std::vector<scene::View> noisy_views(std::uint32_t count, std::uint32_t side) {
  std::vector<scene::View> views;
  for (const scene::Camera& camera : cameras_around(count, side)) {
    scene::View view{fmt::format("{}", views.size()), camera, {camera.width, camera.height, {}}};
    view.image.rgba.resize(4 * std::size_t(side) * side, 255);
    for (std::size_t i = 0; i < view.image.rgba.size(); ++i)
      if (i % 4 != 3) view.image.rgba[i] = static_cast<std::uint8_t>(i * 2654435761u >> 13);
    views.push_back(std::move(view));
  }
  return views;
}

/// Median milliseconds of `work`, which waits for the device, after a first run that compiles kernels.
double median_ms(int repeats, const std::function<void()>& work) {
  std::vector<double> ms;
  for (int i = 0; i <= repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    if (i > 0)
      ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(ms.begin(), ms.end());
  return ms[ms.size() / 2];
}

}  // namespace

void measures(gpu::Device& gpu, const MeasuresOptions& options) {
  constexpr std::uint32_t kViews = 4;
  const std::vector<scene::View> views = noisy_views(kViews, options.side);
  train::SoupBuffers soup;
  load_ball(gpu, soup, options.triangles, {2, 5});
  train::BatchBuffers buffers(gpu);
  train::Step(gpu, soup, buffers).sum_textures();
  const auto evaluate = [&](bool perceptual) {
    train::evaluate(gpu, soup, buffers, views, glm::vec3(0.0f), 0.025, 2.5, {}, {}, {}, {.wanted = perceptual});
  };
  const double whole = median_ms(options.repeats, [&] { evaluate(false); }) / kViews;
  const double with_perceptual = median_ms(options.repeats, [&] { evaluate(true); }) / kViews;
  // Each alone, on the pictures that the evaluation has left.
  const auto sums = [&](train::Ssim ssim) {
    return median_ms(options.repeats, [&] { train::sum_images(gpu, buffers, glm::vec3(0.0f), ssim); }) / kViews;
  };
  const double psnr = sums(train::Ssim::none), ssim = sums(train::Ssim::whole_windows);
  train::MsSsim multiscale(gpu);
  train::Flip flip(gpu);
  const auto one_view = [&](auto& measure) {
    return median_ms(options.repeats, [&] {
      measure.measure(buffers.colour.address(), buffers.target.address(), options.side, options.side);
    });
  };
  const std::vector<std::pair<const char*, double>> rows{{"PSNR", psnr},
                                                         {"PSNR and SSIM", ssim},
                                                         {"MS-SSIM", one_view(multiscale)},
                                                         {"FLIP", one_view(flip)},
                                                         {"evaluation: rendering, PSNR, SSIM", whole},
                                                         {"evaluation with MS-SSIM and FLIP", with_perceptual}};
  std::FILE* const out = text_stream(options.json);
  nlohmann::json json{{"device", gpu.info().name}, {"driver", gpu.info().driver}, {"host", machine()},
                      {"revision", kRevision},     {"side", options.side},        {"triangles", options.triangles}};
  std::fprintf(out, "device: %s, %s\n%u x %u pixels, %u triangles; ms per view, medians of %d\n",
               gpu.info().name.c_str(), gpu.info().driver.c_str(), options.side, options.side, options.triangles,
               options.repeats);
  for (const auto& [name, ms] : rows) {
    std::fprintf(out, "%-36s%10.1f\n", name, ms);
    json["ms_per_view"][name] = ms;
  }
  if (!options.json.empty()) write_output(options.json, json.dump(2) + "\n");
}

}  // namespace trisoup::bench
