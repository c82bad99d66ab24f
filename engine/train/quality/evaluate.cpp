#include "train/quality/evaluate.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include <nlohmann/json.hpp>

#include "args/quantise.h"
#include "base/error.h"
#include "base/printable.h"
#include "gpu/out_of_memory.h"
#include "soup/texture_table.h"
#include "train/quality/covisibility.h"
#include "train/quality/image_sums.h"
#include "train/step/forward_pass.h"
#include "train/step/shared_soup.h"

namespace trisoup::train {

void check_clip_planes(double near, double far) {
  if (!(near > 0 && near < far && far < 1e37))
    throw Error("clip planes: near {} and far {} must be 0 < near < far; correct `near` and `far`", near, far);
}

namespace {

/// Mean over the views that have the metric.
std::optional<double> mean_of(const std::vector<ViewMetrics>& views, std::optional<double> ImageMetrics::*metric) {
  double sum = 0, n = 0;
  for (const ViewMetrics& view : views)
    if (const std::optional<double>& value = view.metrics.*metric) sum += *value, ++n;
  if (n == 0) return std::nullopt;
  return sum / n;
}

/// Mean over the views that have an SSIM; kNoSsim if none has. metrics: those of a view, or null.
template <class Metrics>
double mean_ssim(const std::vector<ViewMetrics>& views, Metrics&& metrics) {
  double sum = 0, n = 0;
  for (const ViewMetrics& view : views)
    if (const ImageMetrics* const m = metrics(view); m && m->pixels > 0 && !std::isnan(m->ssim)) sum += m->ssim, ++n;
  return n > 0 ? sum / n : kNoSsim;
}

}  // namespace

ImageMetrics mean(const std::vector<ViewMetrics>& views) {
  ImageMetrics sum;
  double n = 0;
  for (const ViewMetrics& view : views) {
    if (view.metrics.pixels == 0) continue;
    ++n;
    sum.psnr += view.metrics.psnr;
    sum.mae += view.metrics.mae;
    sum.uncovered += view.metrics.uncovered;
    sum.pixels += view.metrics.pixels;
  }
  if (n == 0) return {};
  return {sum.psnr / n,
          mean_ssim(views, [](const ViewMetrics& view) { return &view.metrics; }),
          sum.mae / n,
          sum.pixels,
          sum.uncovered / n,
          mean_of(views, &ImageMetrics::ms_ssim),
          mean_of(views, &ImageMetrics::flip)};
}

std::optional<CovisibleMean> covisible_mean(const std::vector<ViewMetrics>& views) {
  CovisibleMean sum;
  for (const ViewMetrics& view : views) {
    if (!view.covisible || view.metrics.pixels == 0) continue;
    sum.share += view.covisible->share;
    if (!view.covisible->measured) {
      ++sum.left_out;
      continue;
    }
    ++sum.measured;
    sum.psnr += view.covisible->metrics.psnr;
  }
  if (sum.measured + sum.left_out == 0) return std::nullopt;
  sum.share /= double(sum.measured + sum.left_out);
  if (sum.measured > 0) sum.psnr /= double(sum.measured);
  sum.ssim = mean_ssim(views, [](const ViewMetrics& view) {
    return view.covisible && view.covisible->measured && view.metrics.pixels > 0 ? &view.covisible->metrics : nullptr;
  });
  return sum;
}

namespace {

/// Measures views in batches. Their photographs are on the device at the same time.
class Measurement {
 public:
  static constexpr std::size_t kMost = 4;  // views in a batch

  Measurement(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& views,
              const glm::vec3& background, double near, double far, const OnRender& on_render,
              const Witnesses& witnesses, const ViewExposures& exposures, const PerceptualOptions& perceptual)
      : gpu_(gpu),
        soup_(soup),
        buffers_(buffers),
        views_(views),
        on_render_(on_render),
        witnesses_(witnesses),
        perceptual_options_(perceptual),
        step_(gpu, soup, buffers),
        counts_(gpu.allocate(4ull * soup.triangles, "visible pixels")) {
    inputs_.background = background;
    std::uint64_t largest = 0;
    for (const scene::View& view : views) largest = std::max<std::uint64_t>(largest, view.image.rgba.size());
    photographs_ = gpu.allocate(kMost * largest, "photographs of test views");
    for (const scene::View& view : views) {
      batch_.push_back(batch_view(view.camera, near, far));
      batch_.back().photo = photographs_.address() + (batch_.size() - 1) % kMost * largest;
    }
    if (!exposures.empty()) expose(exposures);
    if (witnesses.views && witnesses.views->size() >= 2)
      covisibility_.emplace(gpu, soup, buffers, *witnesses.views, near, far);
    if (perceptual.wanted) perceptual_.emplace(gpu, perceptual);
  }

  Evaluation run() {
    for (std::size_t first = 0; first < views_.size();) {
      const std::size_t prepared = prepare(first);
      for_each_batch(gpu_, soup_, buffers_, std::span(batch_).subspan(first, prepared), true, inputs_, kMost,
                     [&](std::size_t at, std::size_t count) { measure(first, at, count); });
      first += prepared;
    }
    if (!covisibility_)
      for (ViewMetrics& view : evaluation_.views) view.covisible.reset();
    if (!perceptual_)
      for (ViewMetrics& view : evaluation_.views) view.metrics.ms_ssim = view.metrics.flip = std::nullopt;
    evaluation_.perceptual = perceptual_.has_value();
    evaluation_.mean = mean(evaluation_.views);
    evaluation_.covisible = covisible_mean(evaluation_.views);
    return std::move(evaluation_);
  }

 private:
  void expose(const ViewExposures& exposures) {
    std::vector<soup::ExposureGrid> gains;
    for (std::uint32_t i = 0; i < views_.size(); ++i) {
      gains.push_back(exposures.at(views_[i]));
      batch_[i].index = i;
    }
    exposures_ = allocate_exposures(gpu_, static_cast<std::uint32_t>(views_.size()), kMost, gains);
    inputs_.exposures = &*exposures_;
    inputs_.fit_exposures = false;
  }

  /// Returns how many views, from `first` on, can be measured together.
  std::size_t prepare(std::size_t first) {
    if (covisibility_) try {
        return covisibility_->prepare(std::span(views_).subspan(first));
      } catch (const gpu::OutOfMemory&) {
        if (soup_.partition->size() > 1) throw;  // other ranks may have the memory
        covisibility_.reset();
      }
    return views_.size() - first;
  }

  /// Measures the batch in the buffers: `count` of the prepared views, from number `at` on. The first of the prepared
  /// ones is `first` of all.
  void measure(std::size_t first, std::size_t at, std::size_t count) {
    const auto views = std::span(views_).subspan(first + at, count);
    for (std::size_t i = 0; i < count; ++i) gpu_.upload(batch_[first + at + i].photo, views[i].image.rgba);
    step_.photographs(inputs_);
    const std::vector<ImageSums> sums = sum_images(gpu_, buffers_, inputs_.background, Ssim::whole_windows);
    for (std::size_t i = 0; i < count; ++i)
      evaluation_.views.push_back({views[i].name, metrics_of(sums[i]),
                                   share_shown(gpu_, soup_, buffers_, buffers_.batch().records[i], counts_)});
    const std::vector<std::vector<float>> errors = measure_perceptual(count);
    if (covisibility_) measure_covisible(at, sums);
    for (std::size_t i = 0; i < count; ++i) {
      show(views[i], buffers_.batch().records[i]);
      if (!errors[i].empty()) perceptual_options_.on_errors(views[i], errors[i]);
    }
  }

  /// Measures the last `count` views. Returns their errors, empty without on_errors.
  std::vector<std::vector<float>> measure_perceptual(std::size_t count) {
    std::vector<std::vector<float>> errors(count);
    if (!perceptual_) return errors;
    try {
      for (std::size_t i = 0; i < count; ++i) {
        const kernels::ViewRecord& record = buffers_.batch().records[i];
        errors[i] =
            perceptual_->measure(buffers_.colour.address() + 12ull * record.pixel_offset,
                                 buffers_.target.address() + 4ull * record.pixel_offset, record.width, record.height,
                                 evaluation_.views[evaluation_.views.size() - count + i].metrics);
      }
    } catch (const gpu::OutOfMemory&) {
      if (soup_.partition->size() > 1) throw;  // other ranks may have the memory
      perceptual_.reset();
    }
    return errors;
  }

  /// Measures the batch again with the pixels masked out that are not co-visible. all: sums over all pixels.
  void measure_covisible(std::size_t at, const std::vector<ImageSums>& all) {
    covisibility_->mask(at, all.size());
    const std::vector<ImageSums> sums = sum_images(gpu_, buffers_, inputs_.background, Ssim::centred_in_mask);
    for (std::size_t i = 0; i < all.size(); ++i) {
      CovisibleMetrics covisible{0, metrics_of(sums[i])};
      if (all[i].pixels > 0) covisible.share = double(sums[i].pixels) / double(all[i].pixels);
      covisible.measured =
          covisible.share >= CovisibleMetrics::kLeastShare && (sums[i].windows > 0) == (all[i].windows > 0);
      evaluation_.views[evaluation_.views.size() - all.size() + i].covisible = covisible;
    }
  }

  void show(const scene::View& view, const kernels::ViewRecord& record) {
    const std::size_t pixels = std::size_t(record.width) * record.height;
    if (on_render_)
      on_render_(view,
                 gpu_.download_vector<float>(buffers_.colour.address() + 12ull * record.pixel_offset, 3 * pixels));
    if (!covisibility_ || !witnesses_.on_covisible) return;
    std::vector<std::uint8_t> mask;
    for (const std::uint32_t rgba :
         gpu_.download_vector<std::uint32_t>(buffers_.target.address() + 4ull * record.pixel_offset, pixels))
      mask.push_back(rgba >> 31 != 0 ? 255 : 0);
    witnesses_.on_covisible(view, mask);
  }

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
  const std::vector<scene::View>& views_;
  const OnRender& on_render_;
  const Witnesses& witnesses_;
  const PerceptualOptions& perceptual_options_;
  Step step_;
  StepInputs inputs_;
  gpu::Buffer photographs_, counts_;
  std::vector<BatchView> batch_;
  std::optional<Covisibility> covisibility_;
  std::optional<Perceptual> perceptual_;
  std::optional<Exposures> exposures_;
  Evaluation evaluation_;
};

}  // namespace

Evaluation evaluate(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& views,
                    const glm::vec3& background, double near, double far, const OnRender& on_render,
                    const Witnesses& witnesses, const ViewExposures& exposures, const PerceptualOptions& perceptual) {
  check_clip_planes(near, far);
  return Measurement(gpu, soup, buffers, views, background, near, far, on_render, witnesses, exposures, perceptual)
      .run();
}

namespace {

std::vector<glm::vec3> normalised_vertices(const soup::Model& model, const scene::Normalisation& normalisation) {
  std::vector<glm::vec3> vertices;
  for (const glm::vec3& v : model.vertices)
    vertices.emplace_back(normalisation.to_normalised(glm::dvec3(v) + model.origin));
  return vertices;
}

}  // namespace

void start_from_model(gpu::Device& gpu, SoupBuffers& soup, const soup::Model& model,
                      const scene::Normalisation& normalisation) {
  std::vector<soup::TextureLevels> levels;
  for (const soup::TextureEntry& row : model.textures) levels.push_back({row.level_max, row.level_max});
  const std::vector<soup::TextureEntry> table = soup::make_texture_table(levels).entries;
  Textures textures;
  textures.source = upload_logits(gpu, table, all_of(table), [&](std::size_t t, float* to) {
    const std::uint8_t* values = &model.lattice[std::size_t{model.textures[t].lattice_offset} * soup::kChannels];
    for (std::uint32_t i = 0; i < soup::samples_at(table[t].level_max) * soup::kChannels; ++i) {
      const bool opaque = i % soup::kChannels == soup::kChannels - 1 && values[i] == 255;
      // 0 and 255 stand for all values that round to them, so use the middle of that range.
      const double v = std::clamp(values[i] / 255.0, 0.25 / 255.0, 254.75 / 255.0);
      to[i] = opaque ? kOpaqueLogit : static_cast<float>(std::log(v / (1.0 - v)));
    }
  });
  allocate_soup(gpu, soup, normalised_vertices(model, normalisation), table, std::move(textures));
  allocate_mlp(gpu, soup, model.mlp);
}

namespace {

/// Uploads the 8-bit values of a model as floats in 0..1, and the opacities also as a buffer of their own.
void upload_lattice(gpu::Device& gpu, SoupBuffers& soup, std::span<const std::uint8_t> values) {
  std::vector<float> lattice, opacity;
  lattice.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    lattice.push_back(static_cast<float>(values[i]) / 255.0f);
    if (i % soup::kChannels == soup::kChannels - 1) opacity.push_back(lattice.back());
  }
  soup.lattice = gpu.allocate(lattice.size() * 4, "summed textures");
  soup.opacity = gpu.allocate(opacity.size() * 4, "opacities");
  if (opacity.empty()) return;
  gpu.upload(soup.lattice.address(), lattice);
  gpu.upload(soup.opacity.address(), opacity);
}

void load_into(gpu::Device& gpu, SoupBuffers& soup, const soup::Model& model,
               const scene::Normalisation& normalisation) {
  soup.triangles = static_cast<std::uint32_t>(model.triangles());
  soup.table = model.textures;
  soup.drop_near = model.drop_near;
  for (const soup::TextureEntry& row : soup.table)
    soup.lattice_samples = std::max<std::uint64_t>(soup.lattice_samples,
                                                   std::uint64_t(row.lattice_offset) + soup::samples_at(row.level_max));
  const std::vector<glm::vec3> vertices = normalised_vertices(model, normalisation);
  soup.vertices = gpu.allocate(vertices.size() * sizeof(glm::vec3), "vertices");
  gpu.upload(soup.vertices.address(), vertices);
  soup.ranges = divided(soup.table, soup.partition->size());
  soup.textures = gpu.allocate(soup.table.size() * sizeof(soup::TextureEntry), "texture table");
  gpu.upload(soup.textures.address(), local_rows(soup.table, soup.own()));
  upload_lattice(gpu, soup,
                 ranks::values_of<std::uint8_t>(
                     soup.partition->scatter_from_first(ranks::bytes_of(model.lattice), soup::kChannels)));
  allocate_mlp(gpu, soup, model.mlp);
}

}  // namespace

SoupBuffers load_model(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation) {
  SoupBuffers soup;
  load_into(gpu, soup, model, normalisation);
  return soup;
}

LoadedModel::LoadedModel(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation,
                         ranks::Ranks* ranks, BatchBuffers* in)
    : buffers(in ? *in : own_buffers_.emplace(gpu)) {
  if (ranks && ranks->size() > 1) shared_.emplace(gpu, soup, buffers, *ranks);
  load_into(gpu, soup, model, normalisation);
}

Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene,
                    const std::vector<scene::View>& views, double near, double far, const OnRender& on_render,
                    ranks::Ranks* ranks, const Witnesses& witnesses, const PerceptualOptions& perceptual) {
  LoadedModel loaded(gpu, model, scene.normalisation, ranks);
  return evaluate(gpu, loaded.soup, loaded.buffers, views, model.background, near, far, on_render, witnesses,
                  ViewExposures(model, scene.normalisation), perceptual);
}

Evaluation evaluate(gpu::Device& gpu, const soup::Model& model, const scene::Scene& scene, double near, double far,
                    const OnRender& on_render, ranks::Ranks* ranks, const OnCovisible& on_covisible,
                    const PerceptualOptions& perceptual) {
  return evaluate(gpu, model, scene, scene.test, near, far, on_render, ranks, {&scene.train, on_covisible}, perceptual);
}

soup::Model make_model(gpu::Device& gpu, const SoupBuffers& soup, const glm::vec3& background,
                       const scene::Normalisation& normalisation) {
  soup::Model model;
  // Geographic coordinates are millions of metres, where floats have a resolution of 0.5 m. Far scenes therefore store
  // vertices relative to an origin.
  constexpr double kFar = 64;  // normalised units
  if (glm::length(normalisation.centre) * normalisation.scale > kFar) model.origin = normalisation.centre;
  for (const glm::vec3& v : gpu.download_vector<glm::vec3>(soup.vertices.address(), 3ull * soup.triangles))
    model.vertices.emplace_back(normalisation.to_world(glm::dvec3(v)) - model.origin);
  model.textures = soup.table;
  for (soup::TextureEntry& row : model.textures) row.source_offset = row.level_min = 0;
  // Quantise in pieces on the device: this needs little memory and a quarter of the download.
  static_assert(soup::kChannels == 8);
  constexpr std::uint64_t kPiece = 1 << 19;
  const TriangleRange own = soup.own();
  const std::uint64_t samples = soup.lattice_at(own.last) - soup.lattice_at(own.first);
  const gpu::Buffer packed = gpu.allocate(8 * std::min(kPiece, samples), "textures in 8 bits");
  model.lattice.resize(samples * 8);
  for (std::uint64_t first = 0; first < samples; first += kPiece) {
    const auto count = static_cast<std::uint32_t>(std::min(kPiece, samples - first));
    gpu.launch({"quantise"}, (count + 63) / 64,
               kernels::QuantiseArgs{soup.lattice.address() + 32 * first, packed.address(), count, 0});
    gpu.download(packed.address(), std::as_writable_bytes(std::span(model.lattice).subspan(8 * first, 8ull * count)));
  }
  model.lattice = ranks::values_of<std::uint8_t>(soup.partition->gather_on_first(ranks::bytes_of(model.lattice)));
  model.mlp.parameters = gpu.download_vector<float>(soup.mlp.address(), soup::Mlp::kParameters);
  model.background = background;
  model.drop_near = soup.drop_near;
  model.centre = normalisation.centre;
  model.scale = normalisation.scale;
  return model;
}

nlohmann::json to_json(const Evaluation& evaluation) {
  nlohmann::json json;
  const auto number = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
  };
  const auto put = [&](nlohmann::json& to, const ImageMetrics& m) {
    if (evaluation.perceptual) to["ms_ssim"] = number(m.ms_ssim), to["flip"] = number(m.flip);
    to["psnr"] = m.psnr;
    to["ssim"] = m.ssim;
    to["mae"] = m.mae;
    to["uncovered"] = m.uncovered;
    // Numbers would look like a measurement.
    if (m.pixels == 0) to["psnr"] = to["ssim"] = to["mae"] = to["uncovered"] = nullptr;
  };
  put(json, evaluation.mean);
  if (const auto& mean = evaluation.covisible) {
    json["covisible"] = mean->share;
    json["psnr_covisible"] = mean->psnr;
    json["ssim_covisible"] = mean->ssim;
    if (mean->measured == 0) json["psnr_covisible"] = json["ssim_covisible"] = nullptr;
    json["views_hardly_covisible"] = mean->left_out;
  }
  json["views"] = nlohmann::json::array();
  for (const ViewMetrics& view : evaluation.views) {
    nlohmann::json row;
    row["name"] = utf8(view.name);
    put(row, view.metrics);
    if (const auto& covisible = view.covisible; covisible && view.metrics.pixels > 0) {
      row["covisible"] = covisible->share;
      row["psnr_covisible"] = covisible->metrics.psnr;
      row["ssim_covisible"] = covisible->metrics.ssim;
      if (!covisible->measured) row["psnr_covisible"] = row["ssim_covisible"] = nullptr;
    }
    if (view.triangles_shown) row["triangles_shown"] = *view.triangles_shown;
    json["views"].push_back(row);
  }
  return json;
}

}  // namespace trisoup::train
