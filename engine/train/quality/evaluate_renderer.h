// The real-time renderer held against photographs and against the kernels that train.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "render/renderer.h"
#include "train/quality/evaluate.h"

namespace trisoup::train {

/// As evaluate(), with pictures of the renderer.
Evaluation evaluate_renderer(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near,
                             double far, render::AntiAliasing aa, const OnRender& on_render = {});

/// One view by the renderer without anti-aliasing and by the kernels, from the same 8-bit textures.
struct Agreement {
  std::string view;
  std::size_t pixels = 0;
  std::size_t ties = 0;  // pixels in which they show different triangles: edges and thresholds within rounding
  double psnr = 0;       // dB, of the other pixels; what rounding the picture to 8 bits costs does not count

  /// Whether the renderer draws what was trained: at most most_ties(), and 60 dB or more.
  bool holds() const;
};

/// So many pixels of a picture may show different triangles: a thousandth, and three in a small picture, where a single
/// edge has more than that share.
std::size_t most_ties(std::size_t pixels);

/// views: test views of a scene in normalised coordinates. mlp: how the renderer is to evaluate it.
std::vector<Agreement> agreement(gpu::Device& gpu, const soup::Model& model, const std::vector<scene::View>& views,
                                 const scene::Normalisation& normalisation, double near, double far,
                                 render::MlpUse mlp = render::MlpUse::compiled);

}  // namespace trisoup::train
