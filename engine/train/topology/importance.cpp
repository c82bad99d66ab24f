#include "train/topology/importance.h"

#include <algorithm>
#include <bit>

#include "args/collect_pairs.h"
#include "args/contrast.h"
#include "args/importance.h"
#include "train/step/fixed_sum.h"
#include "train/step/forward_pass.h"
#include "train/step/step.h"

namespace trisoup::train {
namespace {

/// Sums of importance.comp over all batches: one per triangle, and the total.
class Sums {
 public:
  Sums(gpu::Device& gpu, std::uint32_t triangles)
      : gpu_(gpu),
        count_(triangles + 1),
        sums_{gpu.allocate(count_ * 4, "importance"), gpu.allocate(count_ * 4, "importance")} {
    clear(gpu, sums_);
  }
  gpu::Address low() const { return sums_.low.address(); }
  gpu::Address high() const { return sums_.high.address(); }
  std::vector<double> values(double unit) const {
    const auto low = gpu_.download_vector<std::uint32_t>(sums_.low.address(), count_),
               high = gpu_.download_vector<std::uint32_t>(sums_.high.address(), count_);
    std::vector<double> values(count_);
    for (std::size_t i = 0; i < count_; ++i) values[i] = fixed_sum(low[i], high[i]) / unit;
    return values;
  }

 private:
  gpu::Device& gpu_;
  std::uint64_t count_;
  FixedSums sums_;
};

/// Measures batch by batch: contrast of the photographs and errors of three renderings.
class Measurement {
 public:
  Measurement(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const glm::vec3& background,
              std::span<const BatchView> views, const Exposures* exposures)
      : gpu_(gpu),
        soup_(soup),
        buffers_(buffers),
        step_(gpu, soup, buffers),
        whole_(gpu, soup.triangles),
        finest_(gpu, soup.triangles),
        pixels_(gpu.allocate(4ull * soup.triangles, "visible pixels")),
        pairs_(gpu, soup.triangles) {
    inputs_.background = background;
    inputs_.exposures = exposures;
    inputs_.fit_exposures = false;
    gpu.fill(pixels_.address(), pixels_.bytes(), 0);
    double pixels = 0;
    for (const BatchView& view : views) pixels += double(view.width) * view.height;
    // Each pixel contributes up to 3. Fixed-point sums hold up to 2^18.
    while (3 * pixels * unit_ > 0x1p18) unit_ /= 2;
  }

  /// The batch buffers must hold the visible fragments and colours of the batch.
  void measure_batch() {
    const BatchLayout& batch = buffers_.batch();
    buffers_.reserve(batch.views, batch.pixels, batch.tiles, soup_.triangles, true);
    step_.photographs(inputs_);
    measure_contrast();
    gpu_.copy(first(), buffers_.hits.address(), sizeof(kernels::Hit) * std::uint64_t(batch.pixels));
    add_errors(true, whole_);
    render(Layer::behind);
    add_errors(false, whole_);
    pairs_.add(first(), buffers_.hits.address(), batch.pixels);
    render(Layer::coarser);
    add_errors(false, finest_);
  }

  Importance result() {
    Importance importance;
    importance.triangle = whole_.values(unit_);
    importance.error = importance.triangle.back();
    importance.triangle.pop_back();
    importance.finest = finest_.values(unit_);
    importance.finest.pop_back();
    importance.pixels = gpu_.download_vector<std::uint32_t>(pixels_.address(), soup_.triangles);
    importance.behind = pairs_.take();
    return importance;
  }

  const StepInputs& inputs() const { return inputs_; }

 private:
  // Buffers that only training steps need hold the first rendering and its errors.
  gpu::Address first() const { return buffers_.gradient.address(); }  // Hit
  gpu::Address flatness() const { return buffers_.partial.address(); }
  gpu::Address errors() const { return buffers_.partial.address() + 4ull * buffers_.batch().pixels; }

  void render(Layer layer) {
    StepInputs inputs = inputs_;
    inputs.layer = layer;
    inputs.listed = true;
    inputs.first = first();
    step_.visibility(Thresholds::half, inputs);
    step_.shade(inputs);
    step_.expose(inputs);
  }
  void measure_contrast() {
    const BatchLayout& batch = buffers_.batch();
    if (contrast_.bytes() < 16ull * batch.views)
      contrast_ = gpu_.allocate(16ull * batch.views, "contrast of photographs");
    gpu_.upload(contrast_.address(), std::vector<glm::uvec4>(batch.views, {kFixedZero, 0, 0, 0}));
    gpu_.launch({"contrast"}, batch.blocks,
                kernels::ContrastArgs{buffers_.views.address(), buffers_.target.address(), flatness(),
                                      contrast_.address(), batch.views, batch.blocks});
  }
  void add_errors(bool first_rendering, const Sums& to) {
    const BatchLayout& batch = buffers_.batch();
    gpu_.launch(
        {"importance", {first_rendering}}, batch.blocks,
        kernels::ImportanceArgs{buffers_.views.address(), first(), buffers_.colour.address(), buffers_.target.address(),
                                flatness(), contrast_.address(), errors(), to.low(), to.high(), pixels_.address(),
                                batch.views, batch.blocks, soup_.triangles, static_cast<float>(unit_)});
  }

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
  Step step_;
  StepInputs inputs_;
  Sums whole_, finest_;
  gpu::Buffer pixels_, contrast_;
  PairSet pairs_;
  double unit_ = 1.0 / 4096;  // largest scale, because the error of a block, one term, may reach 2^18
};

}  // namespace

PairSet::PairSet(gpu::Device& gpu, std::uint32_t triangles) : gpu_(gpu) {
  make_room(std::bit_ceil(std::max(1024u, 8 * triangles)));
}

void PairSet::make_room(std::uint32_t slots) {
  slots_ = slots;
  table_ = {}, found_ = {};
  table_ = gpu_.allocate(4ull * slots, "pairs of triangles");
  found_ = gpu_.allocate(4 + 8ull * capacity(), "pairs of triangles");
}

void PairSet::add(gpu::Address first, gpu::Address behind, std::uint32_t pixels) {
  for (;; make_room(2 * slots_)) {
    gpu_.fill(table_.address(), 4ull * slots_, 0);
    gpu_.fill(found_.address(), 4, 0);
    gpu_.launch(
        {"collect_pairs"}, (pixels + 63) / 64,
        kernels::CollectPairsArgs{first, behind, table_.address(), found_.address(), pixels, slots_, capacity(), 0});
    const std::uint32_t count = gpu_.download_vector<std::uint32_t>(found_.address(), 1)[0];
    if (count > capacity()) continue;
    const auto words = gpu_.download_vector<std::uint32_t>(found_.address() + 4, 2ull * count);
    for (std::uint32_t i = 0; i < count; ++i) pairs_.emplace_back(words[2 * i], words[2 * i + 1]);
    break;
  }
  // Most views show the same pairs, so remove duplicates after each batch.
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
}

Importance measure_importance(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const glm::vec3& background,
                              std::span<const BatchView> views, const Exposures* exposures, std::size_t max_batch) {
  Measurement measurement(gpu, soup, buffers, background, views, exposures);
  for_each_batch(gpu, soup, buffers, views, true, measurement.inputs(), max_batch,
                 [&](std::size_t, std::size_t) { measurement.measure_batch(); });
  return measurement.result();
}

}  // namespace trisoup::train
