#include "train/quality/evaluate_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/cameras.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {

Evaluation evaluate_renderer(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near,
                             double far, render::AntiAliasing aa, const OnRender& on_render,
                             const PerceptualOptions& perceptual) {
  check_clip_planes(near, far);
  render::Renderer renderer(gpu);
  const render::GpuModel gpu_model = render::upload_model(gpu, model);
  render::DrawOptions options;
  options.aa = aa;
  options.background = model.background;
  options.drop_behind = model.drop_near;
  const ViewExposures exposures(model, scene.normalisation);
  Evaluation evaluation;
  evaluation.perceptual = perceptual.wanted;
  std::optional<Perceptual> measure;
  if (perceptual.wanted) measure.emplace(gpu, perceptual);
  for (const scene::View& view : scene.test) {
    const Image image =
        renderer.picture(gpu_model, render::view_of(view.camera, scene.normalisation, gpu_model, near, far), options);
    std::vector<float> colour;
    colour.reserve(image.rgba.size() / 4 * 3);
    for (std::size_t i = 0; i < image.rgba.size(); ++i)
      if (i % 4 != 3) colour.push_back(static_cast<float>(image.rgba[i]) / 255.0f);
    if (!exposures.empty()) expose(colour, image.width, image.height, exposures.at(view), model.background);
    evaluation.views.push_back({view.name, compare(colour, view.image)});
    evaluation.views.back().metrics.uncovered = std::numeric_limits<double>::quiet_NaN();  // the picture does not say
    std::vector<float> errors;
    if (measure) errors = measure->measure(colour, view.image, evaluation.views.back().metrics);
    if (on_render) on_render(view, colour);
    if (!errors.empty()) perceptual.on_errors(view, errors);
  }
  evaluation.mean = mean(evaluation.views);
  return evaluation;
}

std::size_t max_ties(std::size_t pixels) { return std::max<std::size_t>(pixels / 1000, 3); }

bool RendererComparison::passes() const { return ties <= max_ties(pixels) && psnr > 60; }

std::vector<RendererComparison> compare_renderer(gpu::Device& gpu, const soup::Model& model,
                                                 const std::vector<scene::View>& views,
                                                 const scene::Normalisation& normalisation, double near, double far,
                                                 render::MlpUse mlp) {
  check_clip_planes(near, far);
  SoupBuffers soup = load_model(gpu, model, normalisation);
  BatchBuffers buffers(gpu);
  render::Renderer renderer(gpu);
  const render::GpuModel gpu_model = render::upload_model(gpu, model, mlp);
  render::DrawOptions options;
  options.background = model.background;
  options.drop_behind = model.drop_near;
  std::vector<BatchView> batch;
  for (const scene::View& view : views) batch.push_back(batch_view(view.camera, near, far));
  StepInputs inputs;
  inputs.background = model.background;
  std::vector<RendererComparison> result;
  for_each_batch(gpu, soup, buffers, batch, true, inputs, 1, [&](std::size_t first, std::size_t) {
    const std::size_t pixels = buffers.batch().pixels;
    const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), pixels);
    const auto colour = gpu.download_vector<float>(buffers.colour.address(), 3 * pixels);
    const Image image =
        renderer.picture(gpu_model, render::view_of(views[first].camera, normalisation, gpu_model, near, far), options);
    const std::vector<std::uint32_t> ours = renderer.hits();
    RendererComparison a{views[first].name, pixels, 0, 0};
    double squares = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      if (ours[p] != hits[p].triangle) {
        ++a.ties;
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        const double e = std::max(0.0, std::abs(image.rgba[4 * p + c] - 255.0 * colour[3 * p + c]) - 0.5) / 255.0;
        squares += e * e;
      }
    }
    a.psnr = -10 * std::log10(std::max(
                       1e-10, squares / (3.0 * static_cast<double>(std::max<std::size_t>(1, pixels - a.ties)))));
    result.push_back(a);
  });
  return result;
}

}  // namespace trisoup::train
