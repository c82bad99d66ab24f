// Compares the real-time renderer with photographs and with the training kernels.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "train/quality/evaluate.h"

namespace trisoup::train {

/// As evaluate() for the test views, with images of the real-time renderer. Does not measure triangles_shown.
Evaluation evaluate_renderer(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near,
                             double far, render::AntiAliasing aa, const OnRender& on_render = {},
                             const PerceptualOptions& perceptual = {});

/// Comparison of one view as rendered by the real-time renderer, without anti-aliasing, and by the training kernels.
struct RendererComparison {
  std::string view;
  std::size_t pixels = 0;
  std::size_t ties = 0;  // pixels that show different triangles because of rounding at edges and thresholds
  double psnr = 0;       // dB, over the other pixels; ignores errors from rounding the image to 8 bits

  /// Whether the renderer matches the kernels: at most max_ties(), and above 60 dB.
  bool passes() const;
};

/// Largest allowed number of ties: 0.1 % of the pixels, but at least 3, because a single edge may exceed 0.1 % of a
/// small image.
std::size_t max_ties(std::size_t pixels);

/// Compares each view. views: in normalised coordinates. mlp: how the renderer evaluates the MLP.
std::vector<RendererComparison> compare_renderer(gpu::Device& gpu, const soup::Model& model,
                                                 const std::vector<scene::View>& views,
                                                 const scene::Normalisation& normalisation, double near, double far,
                                                 render::MlpUse mlp = render::MlpUse::compiled);

}  // namespace trisoup::train
