#include "train/worth.h"

#include <utility>

#include "common/host.h"
#include "train/hidden.h"
#include "train/render_pass.h"
#include "train/step.h"

namespace trisoup::train {
namespace {

/// Triangles are hidden in so many turns. What is behind one is then rarely hidden as well.
constexpr std::uint32_t kTurns = 8;

/// The turn in which a triangle is hidden: neighbours, which follow each other, in different ones.
std::uint32_t turn_of(std::uint32_t triangle) { return f32::hash32(triangle) % kTurns; }

/// What a pass shows: of every pixel of every view, one after the other, the winner (0: none, else its number plus 1) and the squared error.
struct Pass {
  std::vector<std::uint32_t> winner;
  std::vector<float> error;
};

/// Squared errors of one view's pixels; masked-out ones have none.
void add_errors(std::span<const float> colour, const Image& photograph, std::vector<float>& to) {
  for (std::size_t p = 0; p < photograph.rgba.size() / 4; ++p) {
    float sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float d = colour[3 * p + c] - static_cast<float>(photograph.rgba[4 * p + c]) / 255.0f;
      sum += d * d;
    }
    to.push_back(photograph.rgba[4 * p + 3] < 128 ? 0.0f : sum);
  }
}

class Passes {
 public:
  Passes(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
         const Exposures* exposures, std::size_t most)
      : gpu_(gpu), soup_(soup), frame_(frame), scene_(scene), views_(views), most_(most) {
    inputs_.background = scene.background;
    inputs_.exposures = exposures;
    inputs_.fit_exposures = false;
  }

  Pass run() {
    Pass pass;
    Step step(gpu_, soup_, frame_);
    for_each_batch(gpu_, soup_, frame_, views_, true, inputs_, most_, [&](std::size_t first, std::size_t count) {
      step.photographs(inputs_);
      const auto hits = gpu_.download_vector<kernels::Hit>(frame_.hits.address(), frame_.batch().pixels);
      const auto colour = gpu_.download_vector<float>(frame_.colour.address(), 3ull * frame_.batch().pixels);
      for (const kernels::Hit& hit : hits) pass.winner.push_back(hit.triangle);
      for (std::size_t i = 0; i < count; ++i) {
        const kernels::ViewRecord& record = frame_.batch().records[i];
        add_errors(std::span(colour).subspan(3ull * record.pixel_offset, 3ull * record.width * record.height), scene_.train[views_[first + i].index].image,
                   pass.error);
      }
    });
    return pass;
  }

 private:
  gpu::Device& gpu_;
  SoupBuffers& soup_;
  Frame& frame_;
  const scene::Scene& scene_;
  std::span<const BatchView> views_;
  StepInputs inputs_;
  std::size_t most_;
};

/// Values of a texture of level `level` ([samples][channels]) that say no more than the next coarser level would: samples in between are interpolated.
void flatten_finest(std::uint32_t level, std::uint32_t channels, float* values) {
  for (std::uint32_t s = 0; s < soup::samples_at(level); ++s) {
    std::uint32_t x = 0, y = 0;
    f32::lattice_point(s, x, y);
    // Edges of the coarser lattice run along x, along y and across from one to the other.
    const std::uint32_t dx = x % 2, dy = y % 2;
    if (dx == 0 && dy == 0) continue;
    const std::uint32_t a = dx == 0 ? f32::lattice_index(x, y - 1) : f32::lattice_index(x - 1, y + dy);
    const std::uint32_t b = dx == 0 ? f32::lattice_index(x, y + 1) : f32::lattice_index(x + 1, y - dy);
    for (std::uint32_t c = 0; c < channels; ++c) values[s * channels + c] = 0.5f * (values[a * channels + c] + values[b * channels + c]);
  }
}

/// Until the levels are summed again no texture has its finest one.
void flatten(gpu::Device& gpu, SoupBuffers& soup) {
  for (const auto& [buffer, channels] : {std::pair(&soup.lattice, std::uint32_t{soup::kChannels}), {&soup.opacity, 1u}}) {
    auto values = gpu.download_vector<float>(buffer->address(), soup.lattice_samples * channels);
    for (const soup::TextureEntry& row : soup.table)
      if (row.level_max > 0) flatten_finest(row.level_max, channels, values.data() + std::size_t{row.lattice_offset} * channels);
    gpu.upload(buffer->address(), values);
  }
}

}  // namespace

Worth measure_worth(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
                    const Exposures* exposures, std::size_t most) {
  Passes passes(gpu, soup, frame, scene, views, exposures, most);
  Worth worth{std::vector<double>(soup.triangles), std::vector<double>(soup.triangles)};
  const Pass whole = passes.run();
  for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
    std::vector<bool> hidden(soup.triangles);
    for (std::uint32_t t = 0; t < soup.triangles; ++t) hidden[t] = turn_of(t) == turn;
    hide(gpu, soup, hidden);
    const Pass without = passes.run();
    Step(gpu, soup, frame).sum_textures();
    for (std::size_t p = 0; p < whole.winner.size(); ++p)
      if (const std::uint32_t t = whole.winner[p]; t != 0 && hidden[t - 1]) worth.triangle[t - 1] += double(without.error[p]) - whole.error[p];
  }
  flatten(gpu, soup);
  const Pass coarser = passes.run();
  // The opacities of a coarser texture let other triangles through here and there: the winner of before answers for its pixels.
  for (std::size_t p = 0; p < whole.winner.size(); ++p)
    if (whole.winner[p] != 0) worth.finest[whole.winner[p] - 1] += double(coarser.error[p]) - whole.error[p];
  Step(gpu, soup, frame).sum_textures();
  return worth;
}

}  // namespace trisoup::train
