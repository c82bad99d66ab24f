#include "train/quality/removed_masks.h"

#include <algorithm>
#include <bit>
#include <cstddef>

#include "scene/fingerprint.h"
#include "train/quality/evaluate.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {
namespace {

constexpr int kMargin = 2;  // pixels around removed triangles

/// Masks out the marked pixels and those around them. Returns their share.
double mask_out(const std::vector<bool>& marked, const scene::Camera& camera, Image& image) {
  const int width = camera.width, height = camera.height;
  const auto at = [&](int x, int y) { return std::size_t(y) * std::size_t(width) + std::size_t(x); };
  if (image.rgba.empty()) {
    image.width = width, image.height = height;
    image.rgba.assign(4 * marked.size(), 255);
  }
  std::vector<bool> masked(marked.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!marked[at(x, y)]) continue;
      for (int v = std::max(0, y - kMargin); v <= std::min(height - 1, y + kMargin); ++v)
        for (int u = std::max(0, x - kMargin); u <= std::min(width - 1, x + kMargin); ++u) masked[at(u, v)] = true;
    }
  for (std::size_t i = 0; i < masked.size(); ++i)
    if (masked[i]) image.rgba[4 * i + 3] = 0;
  return double(std::count(masked.begin(), masked.end(), true)) / double(masked.size());
}

/// Masks all views and returns the mean share of their pixels.
double mask_views(gpu::Device& gpu, LoadedModel& original, const std::vector<bool>& removed,
                  std::vector<scene::View>& views, double near, double far) {
  std::vector<BatchView> drawn;
  for (const scene::View& view : views) drawn.push_back(batch_view(view.camera, near, far));
  double sum = 0;
  for_each_batch(
      gpu, original.soup, original.buffers, drawn, false, {}, views.size(), [&](std::size_t first, std::size_t count) {
        const std::vector<kernels::ViewRecord>& records = original.buffers.batch().records;
        const auto hits =
            gpu.download_vector<kernels::Hit>(original.buffers.hits.address(), original.buffers.batch().pixels);
        for (std::size_t i = 0; i < count; ++i) {
          std::vector<bool> marked(std::size_t(records[i].width) * records[i].height);
          for (std::size_t p = 0; p < marked.size(); ++p) {
            const std::uint32_t hit = hits[records[i].pixel_offset + p].triangle;
            marked[p] = hit > 0 && removed[hit - 1];
          }
          if (std::find(marked.begin(), marked.end(), true) != marked.end())
            sum += mask_out(marked, views[first + i].camera, views[first + i].image);
        }
      });
  return views.empty() ? 0.0 : sum / double(views.size());
}

/// A hash of the removed triangles.
std::uint64_t fingerprint_of(const soup::Model& original, const std::vector<bool>& removed) {
  scene::Fingerprint result;
  for (std::size_t t = 0; t < removed.size(); ++t)
    for (std::size_t k = 0; removed[t] && k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) result.add(double(original.vertices[3 * t + k][axis]));
  return result.value();
}

}  // namespace

RemovedShares mask_removed(gpu::Device& gpu, scene::Scene& scene, const soup::Model& original,
                           const std::vector<bool>& removed, const Settings& settings) {
  // Masks may differ by a pixel between devices, and a checkpoint may go on on another one, so hashes are of what the
  // masks follow from.
  scene.whole = scene::WholePhotographs{
      std::rotl(scene::fingerprint_of_photographs(scene.train), 1) ^ fingerprint_of(original, removed),
      scene::fingerprint_of_photographs(scene.test)};
  LoadedModel loaded(gpu, original, scene.normalisation);
  mask_views(gpu, loaded, removed, scene.validation, settings.test_near, settings.far);
  return {mask_views(gpu, loaded, removed, scene.train, settings.near, settings.far),
          mask_views(gpu, loaded, removed, scene.test, settings.test_near, settings.far)};
}

}  // namespace trisoup::train
