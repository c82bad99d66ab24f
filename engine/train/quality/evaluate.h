// Measures the quality of a model on held-out views.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "gpu/device.h"
#include "ranks/ranks.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/quality/image_metrics.h"
#include "train/step/batch_buffers.h"
#include "train/step/shared_soup.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

struct ViewMetrics {
  std::string name;
  ImageMetrics metrics;
  std::optional<double> triangles_shown = {};  // share of the triangles visible in the view, 0..1, if measured
};

struct Evaluation {
  std::vector<ViewMetrics> views;
  ImageMetrics mean;  // over the views
};

/// Throws Error unless 0 < near < far, both finite.
void check_clip_planes(double near, double far);

/// Mean of each metric over the views with pixels to measure; zeros if there are none. `pixels` is the sum.
ImageMetrics mean(const std::vector<ViewMetrics>& views);

/// Called with each rendered view. colour: [height][width][3], row 0 at the top.
using OnRender = std::function<void(const scene::View& view, const std::vector<float>& colour)>;

/// Renders views in normalised coordinates and compares them with their photographs. Downloads the rendered images only
/// if there is an `on_render`. Throws Error if the clip planes are invalid.
Evaluation evaluate(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& views,
                    const glm::vec3& background, double near, double far, const OnRender& on_render = {});

/// Loads a model for rendering: 8-bit texture values, normalised coordinates, no gradients or moments.
SoupBuffers load_model(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation);

/// A loaded model with batch buffers to render it: `in`, or its own if null. With several ranks, each owns a part of
/// the triangles, as in training, and all must make the same calls. Only the first rank's `model` needs textures.
/// ranks: null for a single process.
class LoadedModel {
 public:
  LoadedModel(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation,
              ranks::Ranks* ranks = nullptr, BatchBuffers* in = nullptr);

 private:
  std::optional<BatchBuffers> own_buffers_;
  std::optional<SharedSoup> shared_;

 public:
  SoupBuffers soup;
  BatchBuffers& buffers;
};

/// Loads a model for training: logits in the finest level only, moments 0. Texels with an opacity of 255 stay opaque.
void start_from_model(gpu::Device& gpu, SoupBuffers& soup, const soup::Model& model,
                      const scene::Normalisation& normalisation);

/// Evaluates a model as in its file: 8-bit texture values, dataset coordinates. views: of `scene`. ranks: null for a
/// single process.
Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene,
                    const std::vector<scene::View>& views, double near, double far, const OnRender& on_render = {},
                    ranks::Ranks* ranks = nullptr);
/// The same for the test views of `scene`.
Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near, double far,
                    const OnRender& on_render = {}, ranks::Ranks* ranks = nullptr);

/// The 8-bit model of a soup, in the dataset's coordinates: value = round(255 * sigmoid).
soup::Model make_model(gpu::Device& gpu, const SoupBuffers& soup, const glm::vec3& background,
                       const scene::Normalisation& normalisation);

/// {"psnr", "ssim", "mae", "uncovered", "views": [{"name", the same four, "triangles_shown"}]}. Metrics without pixels
/// to measure are null.
nlohmann::json to_json(const Evaluation& evaluation);

}  // namespace trisoup::train
