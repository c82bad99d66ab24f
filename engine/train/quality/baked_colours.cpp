#include "train/quality/baked_colours.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "base/parallel_for.h"
#include "common/host.h"
#include "gpu/out_of_memory.h"
#include "image/srgb.h"
#include "soup/bake.h"
#include "soup/colour_fit.h"
#include "train/quality/evaluate.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {
namespace {

constexpr std::size_t kViewsOfBatch = 32;
/// Pixels to render in all views together: per sample, and at least.
constexpr double kPixelsPerSample = 4, kFewestPixels = 1 << 20;

/// The cameras of training views, or all if there are none.
std::vector<scene::Camera> cameras_to_bake(std::span<const soup::ModelCamera> cameras) {
  std::vector<scene::Camera> chosen;
  for (const soup::ModelCamera& c : cameras)
    if (!c.test) chosen.push_back(c.camera);
  if (chosen.empty())
    for (const soup::ModelCamera& c : cameras) chosen.push_back(c.camera);
  return chosen;
}

/// Views of the cameras, made smaller if they have more pixels than the samples need.
std::vector<BatchView> views_to_bake(std::span<const scene::Camera> cameras, std::size_t samples, double near,
                                     double far) {
  double pixels = 0;
  for (const scene::Camera& c : cameras) pixels += double(c.width) * c.height;
  const double needed = std::max(kFewestPixels, kPixelsPerSample * static_cast<double>(samples));
  const double scale = std::min(1.0, std::sqrt(needed / pixels));
  std::vector<BatchView> views;
  for (const scene::Camera& c : cameras) views.push_back(batch_view(c, near, far, scale));
  return views;
}

std::vector<std::uint8_t> fit(gpu::Device& gpu, const soup::Model& model, std::span<const scene::Camera> cameras,
                              double near, double far) {
  SoupBuffers soup = load_model(gpu, model, {model.centre, model.scale});
  BatchBuffers buffers(gpu);
  std::vector<glm::vec3> eyes;
  for (const scene::Camera& camera : cameras) eyes.emplace_back(camera.centre());
  soup::ColourFit colours(model, std::move(eyes));
  StepInputs inputs;
  inputs.background = model.background;
  const auto add = [&](std::size_t first, std::size_t count) {
    const BatchLayout& batch = buffers.batch();
    const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), batch.pixels);
    const auto shown = gpu.download_vector<float>(buffers.colour.address(), 3ull * batch.pixels);
    for (std::size_t i = 0; i < count; ++i) {
      const kernels::ViewRecord& record = batch.records[i];
      const std::size_t pixels = std::size_t(record.width) * record.height;
      colours.add(static_cast<std::uint32_t>(first + i), std::span(hits).subspan(record.pixel_offset, pixels),
                  std::span(shown).subspan(3ull * record.pixel_offset, 3 * pixels));
    }
  };
  const std::vector<BatchView> views = views_to_bake(cameras, model.lattice.size() / soup::kChannels, near, far);
  for (int solution = 0; solution < 2; ++solution) {
    for_each_batch(gpu, soup, buffers, views, true, inputs, kViewsOfBatch, add);
    colours.solve();
  }
  return colours.colours();
}

}  // namespace

std::vector<std::uint8_t> fitted_colours(gpu::Device& gpu, const soup::Model& model,
                                         std::span<const soup::ModelCamera> cameras, double near, double far,
                                         const std::function<void(const std::string& line)>& warn) {
  check_clip_planes(near, far);
  const std::vector<scene::Camera> chosen = cameras_to_bake(cameras);
  if (chosen.empty()) return soup::bake_colours(model, {});
  try {
    return fit(gpu, model, chosen, near, far);
  } catch (const gpu::OutOfMemory& error) {
    if (!warn) throw;
    warn(std::string("the colours for viewers without the neural textures are those of eight directions: ") +
         error.what());
    return soup::bake_colours(model, {});
  }
}

namespace {

/// The colour that a glTF viewer shows of a point of a triangle: light interpolated as in an atlas (atlas.h).
glm::vec3 colour_at(const soup::Model& plain, const kernels::Hit& hit, const std::array<double, 256>& light) {
  const soup::TextureEntry& row = plain.textures[hit.triangle - 1];
  const f32::LatticeSquare square = f32::lattice_square(hit.b0, hit.b1, row.level_max);
  const auto texel = [&](std::uint32_t x, std::uint32_t y, int c) {
    return int(
        plain.lattice[(std::size_t{row.lattice_offset} + f32::lattice_index(x, y)) * soup::kChannels + std::size_t(c)]);
  };
  const std::uint32_t x = square.x, y = square.y;
  const double u = std::clamp(square.fu, 0.0f, 1.0f), v = std::clamp(square.fv, 0.0f, 1.0f);
  glm::vec3 colour;
  for (int c = 0; c < 3; ++c) {
    const int low = texel(x, y, c), right = texel(x + 1, y, c), up = texel(x, y + 1, c);
    const int corner =
        f32::has_upper_half(square, row.level_max) ? texel(x + 1, y + 1, c) : std::clamp(right + up - low, 0, 255);
    const auto lit = [&](int value) { return light[static_cast<std::size_t>(value)]; };
    colour[c] = static_cast<float>(
        srgb_of_light((1 - v) * ((1 - u) * lit(low) + u * lit(right)) + v * ((1 - u) * lit(up) + u * lit(corner))));
  }
  return colour;
}

std::optional<double> psnr_against(const std::vector<float>& colour, const Image& photograph) {
  double squares = 0;
  std::size_t values = 0;
  for (std::size_t p = 0; p < photograph.rgba.size() / 4; ++p) {
    if (photograph.rgba[4 * p + 3] < 128) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double error = std::clamp(colour[3 * p + c], 0.0f, 1.0f) - photograph.rgba[4 * p + c] / 255.0;
      squares += error * error;
      ++values;
    }
  }
  if (values == 0) return std::nullopt;
  return psnr_of(squares / static_cast<double>(values));
}

}  // namespace

std::vector<std::optional<double>> baked_psnr(gpu::Device& gpu, const soup::Model& plain,
                                              const std::vector<scene::View>& views, double near, double far) {
  check_clip_planes(near, far);
  std::array<double, 256> light;
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = light_of_srgb(double(i) / 255);
  SoupBuffers soup = load_model(gpu, plain, {plain.centre, plain.scale});
  BatchBuffers buffers(gpu);
  std::vector<BatchView> batch;
  for (const scene::View& view : views) batch.push_back(batch_view(view.camera, near, far));
  const ViewExposures exposures(plain.exposures);
  std::vector<std::optional<double>> psnr;
  for_each_batch(gpu, soup, buffers, batch, false, {}, 1, [&](std::size_t first, std::size_t) {
    const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), buffers.batch().pixels);
    std::vector<float> colour(3 * hits.size());
    constexpr std::size_t kPixels = 4096;  // of a task
    parallel_for(static_cast<int>((hits.size() + kPixels - 1) / kPixels), 0, [&](int task) {
      const std::size_t from = static_cast<std::size_t>(task) * kPixels;
      for (std::size_t p = from; p < std::min(from + kPixels, hits.size()); ++p) {
        const glm::vec3 shown = hits[p].triangle == 0 ? plain.background : colour_at(plain, hits[p], light);
        std::copy(&shown.x, &shown.x + 3, &colour[3 * p]);
      }
    });
    const scene::View& view = views[first];
    if (!exposures.empty()) expose(colour, view.camera.width, view.camera.height, exposures.at(view), plain.background);
    psnr.push_back(psnr_against(colour, views[first].image));
  });
  return psnr;
}

void add_baked(nlohmann::json& json, std::span<const std::optional<double>> psnr) {
  double sum = 0;
  std::size_t measured = 0;
  for (std::size_t i = 0; i < psnr.size(); ++i) {
    json["views"][i]["psnr_baked"] = psnr[i] ? nlohmann::json(*psnr[i]) : nlohmann::json();
    sum += psnr[i].value_or(0.0);
    measured += psnr[i].has_value();
  }
  json["psnr_baked"] = measured > 0 ? nlohmann::json(sum / static_cast<double>(measured)) : nlohmann::json();
}

}  // namespace trisoup::train
