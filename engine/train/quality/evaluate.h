// Measures the quality of a model on held-out views.
#pragma once

#include <cstddef>
#include <cstdint>
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
#include "train/quality/perceptual.h"
#include "train/quality/view_exposures.h"
#include "train/step/batch_buffers.h"
#include "train/step/shared_soup.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Quality where at least two training views show the surface unhidden (covisibility.h).
struct CovisibleMetrics {
  static constexpr double kLeastShare = 0.01;  // of the pixels; with fewer, PSNR and SSIM are meaningless
  double share = 0;                            // of the pixels inside the loss mask, 0..1
  ImageMetrics metrics;                        // SSIM: mean of the windows centred on co-visible pixels
  bool measured = false;                       // whether there are enough pixels for `metrics`
};

struct ViewMetrics {
  std::string name;
  ImageMetrics metrics;
  std::optional<double> triangles_shown = {};      // share of the triangles visible in the view, 0..1, if measured
  std::optional<CovisibleMetrics> covisible = {};  // if the training views are known
};

/// Means over views. A view with too few co-visible pixels counts in the share only.
struct CovisibleMean {
  double share = 0, psnr = 0, ssim = 0;
  std::size_t measured = 0, left_out = 0;  // number of views with and without `metrics`
};

struct Evaluation {
  std::vector<ViewMetrics> views;
  ImageMetrics mean;  // over the views
  std::optional<CovisibleMean> covisible = {};
  bool perceptual = false;  // whether MS-SSIM and FLIP were measured
};

/// Throws Error unless 0 < near < far, both finite.
void check_clip_planes(double near, double far);

/// Mean of each metric over the views with pixels to measure; zeros if there are none. `pixels` is the sum. MS-SSIM: of
/// the views that are large enough for it.
ImageMetrics mean(const std::vector<ViewMetrics>& views);

/// The mean of ViewMetrics::covisible over the views with pixels to measure; nothing if no view has it.
std::optional<CovisibleMean> covisible_mean(const std::vector<ViewMetrics>& views);

/// Called with each rendered view. colour: [height][width][3], row 0 at the top.
using OnRender = std::function<void(const scene::View& view, const std::vector<float>& colour)>;
/// Called with the mask of each view after its OnRender. mask: [height][width], 255 where co-visible, else 0.
using OnCovisible = std::function<void(const scene::View& view, const std::vector<std::uint8_t>& mask)>;

/// The views on which the model was trained, for co-visibility.
struct Witnesses {
  const std::vector<scene::View>* views = nullptr;  // null or fewer than two: co-visibility is not measured
  OnCovisible on_covisible = {};
};

/// Renders views in normalised coordinates and compares them with their photographs, in the exposures foretold for
/// them. Downloads images and masks only if there is an `on_render` or `on_covisible`. Co-visibility, MS-SSIM and FLIP
/// are not measured either if device memory runs out. Throws Error if the clip planes are invalid.
Evaluation evaluate(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& views,
                    const glm::vec3& background, double near, double far, const OnRender& on_render = {},
                    const Witnesses& witnesses = {}, const ViewExposures& exposures = {},
                    const PerceptualOptions& perceptual = {});

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
                    ranks::Ranks* ranks = nullptr, const Witnesses& witnesses = {},
                    const PerceptualOptions& perceptual = {});
/// The same for the test views of `scene`, and their co-visibility with its training views.
Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near, double far,
                    const OnRender& on_render = {}, ranks::Ranks* ranks = nullptr, const OnCovisible& on_covisible = {},
                    const PerceptualOptions& perceptual = {});

/// The 8-bit model of a soup, in the dataset's coordinates: value = round(255 * sigmoid).
soup::Model make_model(gpu::Device& gpu, const SoupBuffers& soup, const glm::vec3& background,
                       const scene::Normalisation& normalisation);

/// {"psnr", "ssim", "mae", "uncovered", "views": [{"name", the same four, "triangles_shown"}]}, if measured "ms_ssim"
/// and "flip" beside the four, and with co-visibility "psnr_covisible", "ssim_covisible" and "covisible" beside the
/// four, and "views_hardly_covisible", the number of views that psnr_covisible leaves out. Metrics without pixels to
/// measure are null.
nlohmann::json to_json(const Evaluation& evaluation);

}  // namespace trisoup::train
