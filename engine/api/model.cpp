#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "api/impl.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "run/removed_from.h"
#include "train/quality/evaluate.h"

namespace trisoup {
namespace {

constexpr Measure kMeasures[] = {
    {"psnr", &Quality::psnr, "PSNR, dB"},
    {"ssim", &Quality::ssim, "SSIM, 11-tap Gaussian window"},
    {"mae", &Quality::mae, "mean absolute difference, 0 to 1"},
    {"ms_ssim", &Quality::ms_ssim, "MS-SSIM; not a number if a side has fewer than 161 pixels, or during a training"},
    {"flip", &Quality::flip, "mean FLIP error, 0 to 1, at 67 pixels per degree; not a number during a training"},
    {"psnr_covisible", &Quality::psnr_covisible, "PSNR where two training views show the surface; only of test views"},
    {"ssim_covisible", &Quality::ssim_covisible, "the same of SSIM"},
    {"covisible", &Quality::covisible, "share of the pixels that count for psnr_covisible"},
    {"uncovered", &Quality::uncovered, "share of the pixels without a triangle where the photograph has content"},
};

}  // namespace

std::span<const Measure> measures() { return kMeasures; }

Evaluation public_evaluation(const train::Evaluation& e) {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto quality = [](const train::ImageMetrics& m) {
    return Quality{m.psnr, m.ssim, m.mae, m.uncovered, m.ms_ssim.value_or(kNone), m.flip.value_or(kNone)};
  };
  Evaluation result;
  for (const train::ViewMetrics& view : e.views) {
    result.views.push_back({view.name, quality(view.metrics), view.metrics.pixels > 0});
    ViewQuality& of = result.views.back();
    if (!view.covisible) continue;
    of.quality.covisible = view.covisible->share;
    if (!view.covisible->measured) continue;
    of.quality.psnr_covisible = view.covisible->metrics.psnr;
    of.quality.ssim_covisible = view.covisible->metrics.ssim;
  }
  result.mean = quality(e.mean);
  if (!e.covisible) return result;
  result.mean.covisible = e.covisible->share;
  if (e.covisible->measured == 0) return result;
  result.mean.psnr_covisible = e.covisible->psnr;
  result.mean.ssim_covisible = e.covisible->ssim;
  return result;
}

void Model::Impl::finish(soup::ModelFile from) {
  cameras = std::move(from.cameras);
  settings = from.settings.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  faces.resize(model.vertices.size());
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = static_cast<std::int32_t>(i);
  for (const soup::TextureEntry& row : model.textures) {
    texture_offsets.push_back(row.lattice_offset);
    texture_levels.push_back(row.level_max);
  }
  features.reserve(model.lattice.size());
  for (const std::uint8_t value : model.lattice) features.push_back(static_cast<float>(value) / 255.0f);
}

Model::Impl::~Impl() {
  for (const std::weak_ptr<Device::Impl>& known : on_devices) {
    const std::shared_ptr<Device::Impl> device = known.lock();
    if (!device || device->of_another_process()) continue;
    const std::lock_guard lock(device->guard);
    device->models.erase(this);
  }
}

Model::Model(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}

Model Model::read(const std::filesystem::path& path) {
  auto impl = std::make_shared<Impl>();
  const std::string text = read_file(path);
  const auto bytes = std::as_bytes(std::span(text));
  impl->file.assign(bytes.begin(), bytes.end());
  soup::ModelFile file = soup::decode_model(impl->file, path.string());
  impl->model = std::move(file.model);
  try {
    // Models written by other programs may have no settings.
    const nlohmann::json settings = file.settings.is_null() ? nlohmann::json::object() : file.settings;
    impl->near = settings.value("test_near", 0.025);
    impl->far = settings.value("far", 2.5);
    impl->model.drop_near = settings.value("drop_near", settings.contains("steps"));
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: unreadable settings; train the model again", path.string());
  }
  impl->finish(std::move(file));
  return Model(std::move(impl));
}

void Model::write(const std::filesystem::path& path) const { write_file_atomically(path, impl_->file); }

std::size_t Model::triangles() const { return impl_->model.triangles(); }
std::size_t Model::bytes() const { return impl_->file.size(); }
std::span<const std::byte> Model::file() const { return impl_->file; }

std::span<const float> Model::vertices() const {
  static_assert(sizeof(glm::vec3) == 3 * sizeof(float));
  const std::vector<glm::vec3>& vertices = impl_->model.vertices;
  return {vertices.empty() ? nullptr : &vertices[0].x, 3 * vertices.size()};
}

std::span<const std::int32_t> Model::faces() const { return impl_->faces; }

std::array<double, 3> Model::origin() const {
  const glm::dvec3& o = impl_->model.origin;
  return {o.x, o.y, o.z};
}

std::array<double, 3> Model::centre() const {
  const glm::dvec3& c = impl_->model.centre;
  return {c.x, c.y, c.z};
}

double Model::scale() const { return impl_->model.scale; }

std::array<float, 3> Model::background() const {
  const glm::vec3& b = impl_->model.background;
  return {b.r, b.g, b.b};
}

std::span<const std::uint32_t> Model::texture_offsets() const { return impl_->texture_offsets; }
std::span<const std::uint32_t> Model::texture_levels() const { return impl_->texture_levels; }
std::span<const std::uint8_t> Model::texels() const { return impl_->model.lattice; }
std::span<const float> Model::features() const { return impl_->features; }

std::vector<Layer> Model::mlp() const {
  std::vector<Layer> layers;
  std::span<const float> rest = impl_->model.mlp.parameters;
  for (const auto& [inputs, outputs] : {std::pair(soup::Mlp::kInput, soup::Mlp::kHidden),
                                        {soup::Mlp::kHidden, soup::Mlp::kHidden},
                                        {soup::Mlp::kHidden, soup::Mlp::kOutput}}) {
    const auto weights = static_cast<std::size_t>(inputs * outputs), bias = static_cast<std::size_t>(outputs);
    layers.push_back({inputs, outputs, rest.first(weights), rest.subspan(weights, bias)});
    rest = rest.subspan(weights + bias);
  }
  return layers;
}

std::vector<View> Model::cameras() const {
  std::vector<View> views;
  const scene::Normalisation normalisation{impl_->model.centre, impl_->model.scale};
  for (const soup::ModelCamera& c : impl_->cameras)
    views.push_back({c.name, public_camera(c.camera, normalisation), c.test});
  return views;
}

std::string Model::settings() const { return impl_->settings; }

std::array<double, 2> Model::clip_planes() const {
  return {impl_->near / impl_->model.scale, impl_->far / impl_->model.scale};
}

std::vector<float> Model::exposure(const View& view) const {
  const scene::Normalisation normalisation{impl_->model.centre, impl_->model.scale};
  const scene::View seen{view.name, scene::normalised(scene_camera(view.camera), normalisation), {}};
  const soup::ExposureGrid grid = [&] {
    const std::lock_guard lock(impl_->guard);
    if (!impl_->exposures) impl_->exposures.emplace(impl_->model, normalisation);
    return impl_->exposures->at(seen);
  }();
  std::vector<float> gains;
  for (const glm::vec3& gain : train::gains_at_pixels(grid, seen.camera.width, seen.camera.height))
    gains.insert(gains.end(), {gain.x, gain.y, gain.z});
  return gains;
}

Quality Model::quality(Device& device, const Dataset& dataset) const { return evaluate(device, dataset).mean; }

Evaluation Model::evaluate(Device& device, const Dataset& dataset, bool training) const {
  const scene::Scene& scene = dataset.impl().scene;
  const std::vector<scene::View>& views = training ? scene.train : scene.test;
  if (views.empty())
    throw Error("{}: no test views; load the dataset with a positive `test_every`", scene.path.string());
  const DeviceLock lock(device);
  soup::Model model = impl_->model;
  model.background = scene.background;
  const auto measured = [&](const scene::Scene& seen, const std::vector<scene::View>& of) {
    return public_evaluation(train::evaluate(lock.gpu(), model, seen, of, impl_->near, impl_->far, {}, nullptr,
                                             {training ? nullptr : &seen.train}, {.wanted = true}));
  };
  const train::Settings removal = train::removal_of(nlohmann::json::parse(impl_->settings));
  if (removal.removed_from.empty()) return measured(scene, views);
  scene::Scene masked = scene;
  train::leave_out_removed(lock.gpu(), masked, removal);
  return measured(masked, training ? masked.train : masked.test);
}

void Picture::write_png(const std::filesystem::path& path) const {
  if (width < 1 || height < 1 || rgb.size() != std::size_t(width) * std::size_t(height) * 3)
    throw Error("{}: the picture has {} values, expected {} x {} x 3; set width and height to match", path.string(),
                rgb.size(), width, height);
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * std::size_t(height) * 4, 255)};
  for (std::size_t i = 0; i < std::size_t(width) * std::size_t(height); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      image.rgba[4 * i + c] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(rgb[3 * i + c], 0.0f, 1.0f)));
  trisoup::write_png(path, image);
}

}  // namespace trisoup
