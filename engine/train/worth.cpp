#include "train/worth.h"

#include <algorithm>
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

/// Squared errors of one view's pixels, each times its weight.
void add_errors(std::span<const float> colour, const Image& photograph, std::span<const float> weights, std::vector<float>& to) {
  for (std::size_t p = 0; p < photograph.rgba.size() / 4; ++p) {
    float sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float d = colour[3 * p + c] - static_cast<float>(photograph.rgba[4 * p + c]) / 255.0f;
      sum += d * d;
    }
    to.push_back(weights[p] * sum);
  }
}

/// Sums over the windows of 2 kReach + 1 pixels around each, cut at the ends, of `n` values that are `stride` apart.
void sum_windows(std::size_t n, std::size_t stride, double* values) {
  constexpr std::size_t kReach = 3;
  std::vector<double> before(n + 1);
  for (std::size_t i = 0; i < n; ++i) before[i + 1] = before[i] + values[i * stride];
  for (std::size_t i = 0; i < n; ++i) values[i * stride] = before[std::min(n, i + kReach + 1)] - before[i < kReach ? 0 : i - kReach];
}

class Passes {
 public:
  Passes(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
         const Exposures* exposures, std::size_t most)
      : gpu_(gpu), soup_(soup), frame_(frame), scene_(scene), views_(views), most_(most) {
    inputs_.background = scene.background;
    inputs_.exposures = exposures;
    inputs_.fit_exposures = false;
    for (const BatchView& view : views) weights_.push_back(error_weights(scene.train[view.index].image));
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
                   weights_[first + i], pass.error);
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
  std::vector<std::vector<float>> weights_;
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
  const TriangleRange own = soup.own();
  const std::uint64_t first = soup.lattice_at(own.first), samples = soup.lattice_at(own.last) - first;
  if (own.count() == 0) return;
  for (const auto& [buffer, channels] : {std::pair(&soup.lattice, std::uint32_t{soup::kChannels}), {&soup.opacity, 1u}}) {
    auto values = gpu.download_vector<float>(buffer->address(), samples * channels);
    for (std::uint32_t t = own.first; t < own.last; ++t) {
      const soup::TextureEntry& row = soup.table[t];
      if (row.level_max > 0) flatten_finest(row.level_max, channels, values.data() + (row.lattice_offset - first) * channels);
    }
    gpu.upload(buffer->address(), values);
  }
}

}  // namespace

std::vector<float> error_weights(const Image& photograph) {
  const auto width = static_cast<std::size_t>(photograph.width), height = static_cast<std::size_t>(photograph.height), pixels = width * height;
  std::vector<double> count(pixels), sum(pixels), squares(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    const std::uint8_t* rgba = &photograph.rgba[4 * p];
    if (rgba[3] < 128) continue;
    const double grey = (0.299 * rgba[0] + 0.587 * rgba[1] + 0.114 * rgba[2]) / 255.0;
    count[p] = 1, sum[p] = grey, squares[p] = grey * grey;
  }
  std::vector<float> weights(count.begin(), count.end());
  for (auto* values : {&count, &sum, &squares}) {
    for (std::size_t y = 0; y < height; ++y) sum_windows(width, 1, values->data() + y * width);
    for (std::size_t x = 0; x < width; ++x) sum_windows(height, width, values->data() + x);
  }
  constexpr double kC2 = 0.03 * 0.03;  // SSIM's
  double total = 0, inside = 0;
  std::vector<double> lack(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    if (weights[p] == 0) continue;
    const double mean = sum[p] / count[p];
    lack[p] = 1 / (2 * std::max(0.0, squares[p] / count[p] - mean * mean) + kC2);
    total += lack[p], inside += 1;
  }
  for (std::size_t p = 0; p < pixels; ++p)
    if (weights[p] != 0) weights[p] = static_cast<float>(0.5 + 0.5 * lack[p] * inside / total);
  return weights;
}

Worth measure_worth(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, const scene::Scene& scene, std::span<const BatchView> views,
                    const Exposures* exposures, std::size_t most) {
  Passes passes(gpu, soup, frame, scene, views, exposures, most);
  Worth worth{0, std::vector<std::uint32_t>(soup.triangles), std::vector<double>(soup.triangles), std::vector<double>(soup.triangles), {}};
  const Pass whole = passes.run();
  for (std::size_t p = 0; p < whole.winner.size(); ++p) {
    worth.error += whole.error[p];
    if (whole.winner[p] != 0) ++worth.pixels[whole.winner[p] - 1];
  }
  for (std::uint32_t turn = 0; turn < kTurns; ++turn) {
    std::vector<bool> hidden(soup.triangles);
    for (std::uint32_t t = 0; t < soup.triangles; ++t) hidden[t] = turn_of(t) == turn;
    hide(gpu, soup, hidden);
    const Pass without = passes.run();
    Step(gpu, soup, frame).sum_textures();
    std::pair<std::uint32_t, std::uint32_t> last;
    for (std::size_t p = 0; p < whole.winner.size(); ++p) {
      const std::uint32_t t = whole.winner[p], b = without.winner[p];
      if (t == 0 || !hidden[t - 1]) continue;
      worth.triangle[t - 1] += double(without.error[p]) - whole.error[p];
      // Neighbouring pixels mostly show the same two.
      if (b != 0 && std::pair(t - 1, b - 1) != last) worth.behind.push_back(last = {t - 1, b - 1});
    }
  }
  std::sort(worth.behind.begin(), worth.behind.end());
  worth.behind.erase(std::unique(worth.behind.begin(), worth.behind.end()), worth.behind.end());
  flatten(gpu, soup);
  const Pass coarser = passes.run();
  // The opacities of a coarser texture let other triangles through here and there: the winner of before answers for its pixels.
  for (std::size_t p = 0; p < whole.winner.size(); ++p)
    if (whole.winner[p] != 0) worth.finest[whole.winner[p] - 1] += double(coarser.error[p]) - whole.error[p];
  Step(gpu, soup, frame).sum_textures();
  return worth;
}

}  // namespace trisoup::train
