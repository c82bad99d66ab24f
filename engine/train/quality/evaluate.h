// Quality of a model on held-out views.
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
  std::optional<double> triangles_shown =
      {};  // share of the triangles that win a pixel, 0..1; none where that was not measured
};

struct Evaluation {
  std::vector<ViewMetrics> views;
  ImageMetrics mean;  // of the views' values
};

/// Throws Error unless 0 < near < far, both finite.
void check_clip_planes(double near, double far);

/// Mean of every metric over the views that have pixels to measure; zeros where none has.
ImageMetrics mean(const std::vector<ViewMetrics>& views);

/// Called with every rendered view: colour is [height][width][3], row 0 on top.
using OnRender = std::function<void(const scene::View& view, const std::vector<float>& colour)>;

/// Renders the test views of a soup in normalised coordinates and compares them with the photographs. Pictures come to
/// the host for `on_render` alone.
Evaluation evaluate(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& views,
                    const glm::vec3& background, double near, double far, const OnRender& on_render = {});

/// A model as the kernels render it: 8-bit textures, normalised coordinates. No gradients and no moments.
SoupBuffers load_model(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation);

/// The same with a frame to render it in: `in`, or one of its own. With several ranks each has a part of the triangles,
/// as in training, and all make the same calls; the first has the textures, `model` of the others may be without.
/// ranks: null: this process alone.
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

/// The same to be trained on: logits of the finest level alone, moments of zero. What is opaque stays so.
void start_from_model(gpu::Device& gpu, SoupBuffers& soup, const soup::Model& model,
                      const scene::Normalisation& normalisation);

/// The same from a model as it is in its file: 8-bit textures, dataset coordinates. views: of `scene`.
Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene,
                    const std::vector<scene::View>& views, double near, double far, const OnRender& on_render = {},
                    ranks::Ranks* ranks = nullptr);
/// Of the test views.
Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near, double far,
                    const OnRender& on_render = {}, ranks::Ranks* ranks = nullptr);

/// 8-bit model of a soup in training: value = round(255 * sigmoid). `normalisation` takes it back to the dataset's
/// coordinates.
soup::Model make_model(gpu::Device& gpu, const SoupBuffers& soup, const glm::vec3& background,
                       const scene::Normalisation& normalisation);

/// {"psnr", "ssim", "mae", "uncovered", "views": [{"name", the same and "triangles_shown"}]}; null where there was no
/// pixel to measure.
nlohmann::json to_json(const Evaluation& evaluation);

}  // namespace trisoup::train
