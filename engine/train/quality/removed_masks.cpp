#include "train/quality/removed_masks.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "scene/fingerprint.h"
#include "train/quality/evaluate.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {
namespace {

constexpr int kMargin = 2;  // pixels around removed triangles

/// A flag for each pixel of a view, row by row.
using Flags = std::vector<bool>;

/// The pixels that are at most kMargin from a marked one along each axis.
Flags grown(const Flags& marked, int width, int height) {
  Flags all(marked.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!marked[std::size_t(y) * std::size_t(width) + std::size_t(x)]) continue;
      for (int v = std::max(0, y - kMargin); v <= std::min(height - 1, y + kMargin); ++v)
        for (int u = std::max(0, x - kMargin); u <= std::min(width - 1, x + kMargin); ++u)
          all[std::size_t(v) * std::size_t(width) + std::size_t(u)] = true;
    }
  return all;
}

/// Calls visit(i, hits) for each view with the triangle + 1 that each pixel shows, or 0.
template <typename Visit>
void draw_each(gpu::Device& gpu, const soup::Model& model, const scene::Normalisation& normalisation,
               const std::vector<scene::View>& views, double near, double far, const Visit& visit) {
  LoadedModel loaded(gpu, model, normalisation);
  std::vector<BatchView> drawn;
  for (const scene::View& view : views) drawn.push_back(batch_view(view.camera, near, far));
  for_each_batch(
      gpu, loaded.soup, loaded.buffers, drawn, false, {}, views.size(), [&](std::size_t first, std::size_t count) {
        const BatchLayout& batch = loaded.buffers.batch();
        const auto hits = gpu.download_vector<kernels::Hit>(loaded.buffers.hits.address(), batch.pixels);
        for (std::size_t i = 0; i < count; ++i) {
          const kernels::ViewRecord& record = batch.records[i];
          visit(first + i, std::span(hits).subspan(record.pixel_offset, std::size_t(record.width) * record.height));
        }
      });
}

/// Which pixels of each view show a removed triangle; empty if none does.
std::vector<Flags> removed_pixels(gpu::Device& gpu, const scene::Scene& scene, const soup::Model& original,
                                  const std::vector<bool>& removed, const std::vector<scene::View>& views, double near,
                                  double far) {
  std::vector<Flags> all(views.size());
  draw_each(gpu, original, scene.normalisation, views, near, far,
            [&](std::size_t i, std::span<const kernels::Hit> hits) {
              Flags shown;
              for (const kernels::Hit& hit : hits) shown.push_back(hit.triangle > 0 && removed[hit.triangle - 1]);
              if (std::find(shown.begin(), shown.end(), true) != shown.end()) all[i] = std::move(shown);
            });
  return all;
}

/// Masks out the marked pixels and those around them. Returns the mean share of a view's pixels.
double mask_out(const std::vector<Flags>& marked, std::vector<scene::View>& views) {
  double sum = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (marked[i].empty()) continue;
    Image& image = views[i].image;
    if (image.rgba.empty()) {
      image.width = views[i].camera.width, image.height = views[i].camera.height;
      image.rgba.assign(4 * marked[i].size(), 255);
    }
    const Flags masked = grown(marked[i], image.width, image.height);
    for (std::size_t p = 0; p < masked.size(); ++p)
      if (masked[p]) image.rgba[4 * p + 3] = 0;
    sum += double(std::count(masked.begin(), masked.end(), true)) / double(masked.size());
  }
  return views.empty() ? 0.0 : sum / double(views.size());
}

/// Makes marked pixels background if `cleaned` shows nothing there and nothing else is near.
void empty_out(gpu::Device& gpu, scene::Scene& scene, const soup::Model& cleaned, const std::vector<Flags>& marked,
               double near, double far) {
  constexpr std::uint8_t kCounts = 128;  // without coverage (Image)
  const auto byte = [&](int c) { return static_cast<std::uint8_t>(std::lround(255.0f * scene.background[c])); };
  const std::array<std::uint8_t, 4> background{byte(0), byte(1), byte(2), kCounts};
  draw_each(gpu, cleaned, scene.normalisation, scene.train, near, far,
            [&](std::size_t i, std::span<const kernels::Hit> hits) {
              if (marked[i].empty()) return;
              Image& image = scene.train[i].image;
              Flags other;
              for (std::size_t p = 0; p < hits.size(); ++p) other.push_back(!marked[i][p] || hits[p].triangle > 0);
              other = grown(other, image.width, image.height);
              for (std::size_t p = 0; p < other.size(); ++p)
                if (!other[p]) std::copy(background.begin(), background.end(), &image.rgba[4 * p]);
            });
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
                           const std::vector<bool>& removed, const soup::Model& cleaned, const Settings& settings) {
  // Masks may differ by a pixel between devices, and a checkpoint may go on on another one, so hashes are of what the
  // masks follow from.
  if (!scene.whole)
    scene.whole = scene::WholePhotographs{scene::fingerprint_of_photographs(scene.train),
                                          scene::fingerprint_of_photographs(scene.test)};
  scene.whole->train = std::rotl(scene.whole->train, 1) ^ fingerprint_of(original, removed);
  const auto mask = [&](std::vector<scene::View>& views) {
    return mask_out(removed_pixels(gpu, scene, original, removed, views, settings.test_near, settings.far), views);
  };
  RemovedShares shares;
  mask(scene.validation);
  shares.test = mask(scene.test);
  const std::vector<Flags> shown =
      removed_pixels(gpu, scene, original, removed, scene.train, settings.near, settings.far);
  shares.train = mask_out(shown, scene.train);
  empty_out(gpu, scene, cleaned, shown, settings.near, settings.far);
  return shares;
}

}  // namespace trisoup::train
