// Tests engine/train/step/step.cpp and the kernels it launches, beyond the golden vectors (tests/golden).
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numeric>

#include "base/error.h"
#include "common/host.h"
#include "draws.h"
#include "gpu/small_scene.h"
#include "lattice_gradient.h"

using namespace trisoup;
using test::SmallScene;

namespace {

const std::vector<soup::TextureLevels> kFine{{2, 5}};

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * 4) == 0;
}

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

}  // namespace

TEST_CASE("twenty steps from the same state give the same bits", "[step][same_code]") {
  auto gpu = test::open_device();
  std::vector<std::vector<float>> states;
  for (int run = 0; run < 2; ++run) {
    SmallScene s(*gpu, 40, kFine, {test::view_from(0, 48, 40), test::view_from(2, 33, 47)});
    s.buffers.reserve_lists(1 << 16);
    for (std::uint32_t i = 0; i < 20; ++i) s.train(i, SmallScene::rates(i));
    states.push_back(s.state());
  }
  CHECK(all_finite(states[0]));
  CHECK(same_bits(states[0], states[1]));
  test::require_silence(*gpu);
}

TEST_CASE("lists that are too small change nothing; after growing they give the same bits", "[step]") {
  auto gpu = test::open_device();
  const std::vector<train::BatchView> views{test::view_from(0, 64, 64), test::view_from(2, 64, 64)};
  SmallScene roomy(*gpu, 60, kFine, views);
  roomy.buffers.reserve_lists(1 << 16);
  SmallScene tight(*gpu, 60, kFine, views);
  tight.buffers.lists = gpu->allocate(64 * 4, "too small on purpose");
  const std::vector<float> before = tight.state();

  tight.train(5, SmallScene::rates(0));
  tight.train(6, SmallScene::rates(1));
  CHECK(same_bits(tight.state(), before));
  const auto overflow = train::grow_lists_if_needed(*gpu, tight.buffers);
  REQUIRE(overflow.has_value());
  CHECK(*overflow == 5);

  for (auto* s : {&roomy, &tight}) {
    s->train(5, SmallScene::rates(0));
    s->train(6, SmallScene::rates(1));
  }
  CHECK_FALSE(train::grow_lists_if_needed(*gpu, tight.buffers).has_value());
  CHECK_FALSE(same_bits(tight.state(), before));
  CHECK(same_bits(tight.state(), roomy.state()));
  test::require_silence(*gpu);
}

TEST_CASE("bands of tiles and one pixel per thread give the same bits as a step without bands", "[step]") {
  auto gpu = test::open_device();
  const std::vector<train::BatchView> views{test::view_from(0, 100, 64), test::view_from(2, 64, 75)};
  std::vector<std::vector<float>> states;
  for (int variant = 0; variant < 3; ++variant) {
    SmallScene s(*gpu, 60, {{2, 4}, {0, 0}, {2, 3}, {1, 2}, {2, 2}, {2, 5}}, views);
    if (variant == 2) s.buffers.one_pixel = s.buffers.wide_textures = true;  // the default on GPUs
    if (variant == 1) {
      s.buffers.most_entries = 300;
      s.buffers.lists = gpu->allocate(300 * 4, "few entries");
    }
    for (std::uint32_t i = 0; i < 3; ++i) {
      do s.train(i, SmallScene::rates(i));
      while (train::grow_lists_if_needed(*gpu, s.buffers));
    }
    CHECK((s.buffers.bands() > 3) == (variant == 1));
    states.push_back(s.state());
  }
  CHECK(all_finite(states[0]));
  CHECK(same_bits(states[0], states[1]));
  CHECK(same_bits(states[0], states[2]));
  test::require_silence(*gpu);
}

TEST_CASE("a step queue and a recorded step give the same bits as single steps", "[step]") {
  auto gpu = test::open_device();
  const std::vector<train::BatchView> first{test::view_from(0, 48, 40), test::view_from(2, 33, 47)},
      second{test::view_from(4, 48, 40), test::view_from(5, 33, 47)};
  SmallScene single(*gpu, 40, kFine, first), recorded(*gpu, 40, kFine, first);
  for (auto* s : {&single, &recorded}) s->buffers.reserve_lists(1 << 16);

  train::StepQueue schedule(*gpu);
  for (std::uint32_t i = 0; i < 8; ++i) {
    const auto& views = i % 3 == 1 ? second : first;
    single.buffers.set_batch(views, 40, true);
    single.train(i, SmallScene::rates(i));
    const train::BatchLayout batch = train::lay_out(views);
    schedule.add(train::Step::state(i * 7919u + 1u, i, i, SmallScene::rates(i), batch), batch);
  }
  schedule.upload();
  gpu::CommandList list = gpu->record([&] {
    schedule.begin_step(recorded.buffers);
    recorded.step.train(recorded.inputs);
  });
  for (int i = 0; i < 8; ++i) {
    gpu->replay(list);
    // Any allocation makes a backend translate the list again. The list does not use this buffer.
    if (i == 4) gpu->allocate(1 << 16, "something else");
  }
  CHECK(same_bits(recorded.state(), single.state()));
  const auto rows = [&](SmallScene& s) {
    return gpu->download_vector<std::uint32_t>(s.buffers.statistics.address(), 8 * 8);
  };
  CHECK(rows(recorded) == rows(single));
  test::require_silence(*gpu);
}

TEST_CASE("the work of a submission is bounded: 100,000 triangles that cover an image of 3840 x 2160",
          "[.][watchdog]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kTriangles = 100'000;
  SmallScene s(*gpu, kTriangles, {{0, 0}}, {test::view_from(0, 8, 8)});
  std::vector<glm::vec3> vertices;
  for (std::uint32_t t = 0; t < kTriangles; ++t) {
    // The nearest triangle is in the middle of the list. The camera is at x = 1 and looks along the x axis.
    const float x = 0.4f - 1e-5f * std::abs(static_cast<float>(t) - 61'803.0f);
    for (const glm::vec2 corner : {glm::vec2(-9, -9), glm::vec2(9, -9), glm::vec2(0, 18)})
      vertices.emplace_back(x, corner.x, corner.y);
  }
  gpu->upload(s.soup.vertices.address(), vertices);
  gpu->upload(s.soup.source.address(), std::vector<float>(kTriangles * 24ull, 3.0f));
  s.step.sum_textures();
  s.buffers.set_batch(std::vector{test::view_from(0, 3840, 2160)}, kTriangles, true);
  s.step.begin(1, 0, 0, {});

  const auto visibility = [&] { return gpu->record([&] { s.step.visibility(train::Thresholds::half, s.inputs); }); };
  // Checks the limits of a segment: pairs of a tile and a triangle that it compares, and pairs of a pixel and a
  // triangle that it may visit.
  const auto within_bound = [&](const gpu::CommandList& list) {
    std::uint64_t tiles = 0;
    for (const gpu::CommandList::Segment& segment : list.segments)
      for (const gpu::CommandList::Command& command : segment)
        if (const auto* launch = std::get_if<gpu::CommandList::Launch>(&command);
            launch && launch->kernel == gpu::Kernel{"visibility", {0, 0}}) {
          CHECK(launch->groups * kTriangles <= train::BatchBuffers::kMostPairs);
          CHECK(s.buffers.list_capacity() * 64ull <= train::BatchBuffers::kMostPairs);
          tiles += launch->groups;
        }
    CHECK(tiles == s.buffers.batch().tiles);
  };
  gpu::CommandList list = visibility();
  within_bound(list);
  // A band has more entries than the lists can store. The device reports this, and bands become smaller until one fits.
  bool fits = false;
  for (int tries = 0; tries < 4 && !fits; ++tries) {
    gpu::CommandList last;
    last.segments.push_back(list.segments.back());
    if (tries == 0) last.segments.insert(last.segments.begin(), list.segments.front());  // projects
    gpu->replay(last);
    fits = !train::grow_lists_if_needed(*gpu, s.buffers);
    list = visibility();
    within_bound(list);
  }
  REQUIRE(fits);
  CHECK(list.segments.size() > 500);
  // The whole image would take an hour on a CPU, so the test checks only the last band, drawn above, and the middle
  // one.
  gpu::CommandList middle;
  middle.segments.push_back(list.segments[list.segments.size() / 2]);
  gpu->replay(middle);
  CHECK_FALSE(train::grow_lists_if_needed(*gpu, s.buffers));
  const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
  CHECK(hits[hits.size() - 1].triangle == 61'803 + 1);
  CHECK(hits[hits.size() / 2].triangle == 61'803 + 1);
  test::require_silence(*gpu);
}

TEST_CASE("all buffers of a step before the optimiser match those of the CPU backend", "[step][each_driver]") {
  auto gpu = test::open_device();
  gpu::DeviceOptions on_cpu;
  on_cpu.backend = "cpu";
  auto cpu = gpu::open_device(on_cpu);
  const std::vector<train::BatchView> views{test::view_from(0, 96, 80), test::view_from(2, 64, 75)};
  using Named = std::vector<std::pair<const char*, std::vector<double>>>;
  std::vector<Named> buffers;
  for (gpu::Device* device : {gpu, cpu.get()}) {
    SmallScene s(*device, 60, kFine, views);
    s.buffers.reserve_lists(1 << 16);
    s.step.begin(7, 0, 0, SmallScene::rates(0));
    s.step.visibility(train::Thresholds::random, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    s.step.backward(s.inputs);
    Named& named = buffers.emplace_back();
    const std::size_t pixels = s.buffers.batch().pixels;
    const auto floats = [&](const char* name, const gpu::Buffer& buffer, std::size_t count) {
      const auto values = device->download_vector<float>(buffer.address(), count);
      named.emplace_back(name, std::vector<double>(values.begin(), values.end()));
    };
    const auto sums = [&](const char* name, const train::FixedSums& of, std::size_t count) {
      const auto low = device->download_vector<std::uint32_t>(of.low.address(), count),
                 high = device->download_vector<std::uint32_t>(of.high.address(), count);
      std::vector<double> values(count);
      for (std::size_t i = 0; i < count; ++i) values[i] = train::fixed_sum(low[i], high[i]);
      named.emplace_back(name, std::move(values));
    };
    std::vector<double> triangles, rest;
    for (const kernels::Hit& h : device->download_vector<kernels::Hit>(s.buffers.hits.address(), pixels)) {
      triangles.push_back(h.triangle);
      for (const float v : {h.b0, h.b1, h.depth}) rest.push_back(v);
    }
    named.emplace_back("visible triangles", std::move(triangles));
    named.emplace_back("barycentrics and depth", std::move(rest));
    floats("colours", s.buffers.colour, 3 * pixels);
    floats("colour gradients", s.buffers.gradient, 4 * pixels);
    named.emplace_back("lattice gradients", test::lattice_gradient(*device, s.soup, s.buffers));
    sums("vertex gradients", s.soup.vertex_gradient, 9ull * s.soup.triangles);
    // Devices divide the sum over pixels into different parts.
    const auto partial = device->download_vector<float>(s.buffers.mlp_partial.address(),
                                                        std::size_t(s.buffers.mlp_groups) * soup::Mlp::kParameters);
    std::vector<double> mlp(soup::Mlp::kParameters);
    for (std::size_t i = 0; i < partial.size(); ++i) mlp[i % soup::Mlp::kParameters] += partial[i];
    named.emplace_back("MLP gradients", std::move(mlp));
  }
  for (std::size_t b = 0; b < buffers[0].size(); ++b) {
    const auto& [name, ours] = buffers[0][b];
    const auto& theirs = buffers[1][b].second;
    CAPTURE(name);
    REQUIRE(ours.size() == theirs.size());
    double largest = 0, difference = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
      largest = std::max(largest, std::abs(theirs[i]));
      difference = std::max(difference, std::abs(ours[i] - theirs[i]));
    }
    CHECK(largest > 0);
    CHECK(difference <= 1e-4 * largest);
  }
  test::require_silence(*gpu);
}

TEST_CASE("levels of a texture are summed, and gradients use the transposed interpolation", "[textures]") {
  auto gpu = test::open_device();
  // One table with different levels, as with adaptive levels.
  const std::vector<soup::TextureLevels> levels{{2, 5}, {0, 0}, {1, 3}, {0, 5}, {5, 5}, {3, 4}};
  SmallScene s(*gpu, static_cast<std::uint32_t>(levels.size()), levels, {test::view_from(0, 48, 48)});
  const auto lattice = gpu->download_vector<float>(s.soup.lattice.address(), s.soup.lattice_samples * 8);

  soup::Random random(7);
  std::vector<double> gradient(s.soup.lattice_samples * 8);
  for (double& g : gradient) g = (random.uniform01() - 0.5) * 1e-3;
  test::set_lattice_gradient(*gpu, s.soup, s.buffers, gradient);
  const gpu::Buffer seen = gpu->allocate(s.soup.source_samples * 32, "gradient");
  train::StepInputs inputs;
  inputs.probes.source_gradient = seen.address();
  gpu->fill(s.buffers.mlp_partial.address(), s.buffers.mlp_partial.bytes(), 0);
  s.step.begin(1, 0, 0, {});
  s.step.update(inputs);
  const auto actual = gpu->download_vector<float>(seen.address(), s.soup.source_samples * 8);

  double worst_value = 0, worst_gradient = 0;
  for (std::size_t t = 0; t < levels.size(); ++t) {
    const soup::TextureEntry& row = s.soup.table[t];
    std::vector<double> expected(soup::samples_in(row.level_min, row.level_max) * 8, 0.0);
    for (std::uint32_t p = 0; p < soup::samples_at(row.level_max); ++p) {
      std::uint32_t x = 0, y = 0;
      f64::lattice_point(p, x, y);
      const double r = 1u << row.level_max;
      for (int c = 0; c < 8; ++c) {
        const std::size_t at = (std::size_t(row.lattice_offset) + p) * 8 + c;
        double sum = 0;
        std::uint32_t base = 0;
        for (std::uint32_t l = row.level_min; l <= row.level_max; ++l) {
          const f64::LatticeCell cell = f64::lattice_cell(x / r, y / r, l);
          const auto logit = [&](std::uint32_t i) {
            return double(s.logits[(std::size_t(row.source_offset) + base + i) * 8 + c]);
          };
          sum += cell.w0 * logit(cell.i0) + cell.w1 * logit(cell.i1) + cell.w2 * logit(cell.i2);
          base += soup::samples_at(l);
        }
        const double value = f64::sigmoid(sum);
        worst_value = std::max(worst_value, std::abs(value - lattice[at]));
        const double g = gradient[at] * value * (1 - value);
        base = 0;
        for (std::uint32_t l = row.level_min; l <= row.level_max; ++l) {
          const f64::LatticeCell cell = f64::lattice_cell(x / r, y / r, l);
          expected[(base + cell.i0) * 8 + c] += cell.w0 * g;
          expected[(base + cell.i1) * 8 + c] += cell.w1 * g;
          expected[(base + cell.i2) * 8 + c] += cell.w2 * g;
          base += soup::samples_at(l);
        }
      }
    }
    for (std::size_t i = 0; i < expected.size(); ++i)
      worst_gradient = std::max(worst_gradient, std::abs(expected[i] - actual[std::size_t(row.source_offset) * 8 + i]));
  }
  CHECK(worst_value < 1e-6);
  CHECK(worst_gradient < 1e-3 * 1e-5);
  test::require_silence(*gpu);
}

TEST_CASE("the mean of the opacity gradient over thresholds is the gradient of the expected error", "[opacity]") {
  auto gpu = test::open_device();
  // Three triangles in one view, each with constant opacity and colour (without the MLP: feature 3 is 0).
  SmallScene s(*gpu, 3, {{0, 0}}, {test::view_from(0, 8, 8)});
  const double alpha[3] = {0.3, 0.6, 0.8}, shade[3] = {0.1, 0.5, 0.9}, background = 1.0;
  std::vector<float> logits(s.logits.size());
  for (std::size_t t = 0; t < 3; ++t)
    for (std::size_t k = 0; k < 3; ++k)
      for (int c = 0; c < 8; ++c) {
        const double value = c < 3 ? shade[t] : c == 3 ? 1e-9 : c == 7 ? alpha[t] : 0.5;
        logits[(t * 3 + k) * 8 + c] = static_cast<float>(std::log(value / (1 - value)));
      }
  gpu->upload(s.soup.source.address(), logits);
  // All cover the whole image, in the order 2, 0, 1 from the camera at x = 1.
  const float depth[3] = {0.0f, -0.2f, 0.2f};
  std::vector<glm::vec3> vertices;
  for (const float x : depth) vertices.insert(vertices.end(), {{x, -9, -9}, {x, 9, -9}, {x, 0, 18}});
  gpu->upload(s.soup.vertices.address(), vertices);
  s.inputs.background = glm::vec3(static_cast<float>(background));
  const bool flat = GENERATE(false, true);
  if (flat) gpu->upload(s.target.address(), std::vector<float>(192, 0.45f));
  const auto target = gpu->download_vector<float>(s.target.address(), 192);
  s.step.sum_textures();

  // Exact by enumeration: E[L1] is the mean over pixels and channels of the sum over fragments of weight times error.
  const int order[3] = {2, 0, 1};
  double exact[3] = {};
  for (int which = 0; which < 3; ++which) {
    for (const float t : target) {
      double through = 1, d_through = 0, sum = 0;
      for (const int f : order) {
        const double e = std::abs(shade[f] - t), a = alpha[f], da = f == which ? 1 : 0;
        sum += (d_through * a + through * da) * e;
        d_through = d_through * (1 - a) - through * da;
        through *= 1 - a;
      }
      sum += d_through * std::abs(background - t);
      exact[which] += sum / 192;
    }
  }

  const int samples = test::draws(*gpu, 2000);
  double variance[2][3] = {};
  for (const bool baseline : {false, true}) {
    CAPTURE(flat, baseline);
    s.inputs.opacity_baseline = baseline;
    double mean[3] = {}, square[3] = {};
    for (int i = 0; i < samples; ++i) {
      train::clear(*gpu, s.soup.opacity_gradient);
      s.step.begin(f32::hash32(i), 0, 0, {});
      s.step.visibility(train::Thresholds::random, s.inputs);
      s.step.shade(s.inputs);
      s.step.loss(s.inputs);
      s.step.backward(s.inputs);
      const auto low = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.low.address(), 9);
      const auto high = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.high.address(), 9);
      for (int t = 0; t < 3; ++t) {
        double g = 0;
        for (int k = 0; k < 3; ++k) g += train::fixed_sum(low[t * 3 + k], high[t * 3 + k]);
        mean[t] += g / samples;
        square[t] += g * g / samples;
      }
    }
    for (int t = 0; t < 3; ++t) {
      variance[baseline][t] = square[t] - mean[t] * mean[t];
      const double error = std::sqrt(variance[baseline][t] / samples);
      CAPTURE(t, mean[t], exact[t], error);
      CHECK(std::abs(mean[t] - exact[t]) < 4 * error);
      if (gpu->info().backend == "cpu")
        CHECK(error < 0.1 * std::abs(exact[t]) + 1e-3);  // otherwise the test proves nothing
    }
  }
  for (int t = 0; t < 3; ++t) {
    CAPTURE(flat, t, variance[0][t], variance[1][t]);
    CHECK(variance[1][t] < (flat ? 0.5 : 1.0) * variance[0][t]);
  }
  test::require_silence(*gpu);
}

TEST_CASE("masked pixels do not affect opacity gradients, neither their own nor those of neighbours", "[opacity]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 2, {{0, 0}}, {test::view_from(0, 16, 16)});
  // Seen from the camera at x = 1, each triangle covers one half of the image. The half of the second one is masked.
  gpu->upload(s.soup.vertices.address(),
              std::vector<glm::vec3>{{0, -9, 0}, {0, 9, 0}, {0, 0, 18}, {0, -9, 0}, {0, 9, 0}, {0, 0, -18}});
  s.inputs.opacity_baseline = true;
  s.inputs.target = 0;
  const auto gradients = [&](std::uint8_t masked_value) {
    std::vector<std::uint32_t> photo(256);
    soup::Random random(5);
    s.step.begin(1, 0, 0, {});
    s.step.visibility(train::Thresholds::half, s.inputs);  // finds which half of the rows a triangle covers
    gpu->upload(s.soup.opacity.address(), std::vector<float>(6, 1.0f));
    s.step.visibility(train::Thresholds::half, s.inputs);
    const auto hits = gpu->download_vector<kernels::Hit>(s.buffers.hits.address(), 256);
    int covered[3] = {};
    for (int p = 0; p < 256; ++p) {
      ++covered[hits[p].triangle];
      const std::uint32_t grey = random.below(256);
      photo[p] = hits[p].triangle == 1 ? 0xff000000u | grey * 0x010101u : masked_value * 0x010101u;
    }
    CHECK(covered[1] == 128);
    CHECK(covered[2] == 128);
    const gpu::Buffer photos = gpu->allocate(1024, "photograph");
    gpu->upload(photos.address(), photo);
    s.views[0].photo = photos.address();
    s.buffers.set_batch(s.views, 2, true);
    s.step.sum_textures();
    train::clear(*gpu, s.soup.opacity_gradient);
    s.step.begin(1, 0, 0, {});
    s.step.visibility(train::Thresholds::random, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    s.step.backward(s.inputs);
    gpu->wait();
    const auto low = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.low.address(), 6),
               high = gpu->download_vector<std::uint32_t>(s.soup.opacity_gradient.high.address(), 6);
    std::vector<double> out;
    for (int sample = 0; sample < 6; ++sample) out.push_back(train::fixed_sum(low[sample], high[sample]));
    return out;
  };
  const auto black = gradients(0), white = gradients(255);
  for (int k = 0; k < 3; ++k) {
    CHECK(black[k] != 0);
    CHECK(black[3 + k] == 0);
  }
  CHECK(black == white);
  test::require_silence(*gpu);
}

TEST_CASE("a batch can contain views of any size, also smaller than the SSIM window", "[step]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views{test::view_from(0, 1, 1), test::view_from(1, 7, 5), test::view_from(2, 17, 33),
                                      test::view_from(3, 64, 48)};
  for (std::uint32_t v = 0; v < views.size(); ++v) views[v].index = v;
  constexpr std::uint32_t kTriangles = 30;
  SmallScene together(*gpu, kTriangles, kFine, views);
  together.buffers.reserve_lists(1 << 16);
  const auto& batch = together.buffers.batch();
  // A single view gets the same weights as in the batch.
  const auto run = [&](SmallScene& s) {
    s.step.begin(1, 0, 0, {});
    const float weights[2] = {static_cast<float>(1.0 / (3.0 * batch.pixels)),
                              static_cast<float>(1.0 / (3.0 * double(batch.windows)))};
    gpu->upload(s.buffers.state.address() + offsetof(kernels::StepState, pixel_weight),
                std::as_bytes(std::span(weights)));
    s.step.visibility(train::Thresholds::random, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    s.step.backward(s.inputs);
  };
  run(together);
  const auto floats = [&](const gpu::Buffer& buffer, std::size_t count) {
    return gpu->download_vector<float>(buffer.address(), count);
  };
  const auto colours = floats(together.buffers.colour, 3ull * batch.pixels),
             gradients = floats(together.buffers.gradient, 4ull * batch.pixels);
  CHECK(all_finite(colours));
  CHECK(all_finite(gradients));
  const auto target = floats(together.target, 3ull * batch.pixels);

  const std::size_t lattice_words = together.soup.lattice_samples * 8, vertex_words = 9 * kTriangles;
  const auto sums = [&](const train::FixedSums& words, std::size_t count) {
    const auto low = gpu->download_vector<std::uint32_t>(words.low.address(), count),
               high = gpu->download_vector<std::uint32_t>(words.high.address(), count);
    std::vector<std::uint64_t> out(count);
    for (std::size_t i = 0; i < count; ++i) out[i] = (std::uint64_t(high[i]) << 32 | low[i]) - 0x80000000ull;
    return out;
  };
  const auto losses = [&](SmallScene& s) {
    const auto r = gpu->download_vector<kernels::Statistics>(s.buffers.statistics.address(), 1)[0];
    return std::array{train::fixed_sum(r.l1_low, r.l1_high), train::fixed_sum(r.ssim_low, r.ssim_high),
                      train::fixed_sum(r.mse_low, r.mse_high)};
  };
  const auto mlp_gradient = [&](SmallScene& s) {
    const auto partial = floats(s.buffers.mlp_partial, std::uint64_t{soup::Mlp::kParameters} * s.buffers.mlp_groups);
    std::vector<double> out(soup::Mlp::kParameters, 0.0);
    for (std::size_t i = 0; i < partial.size(); ++i) out[i % soup::Mlp::kParameters] += partial[i];
    return out;
  };
  std::vector<std::int64_t> lattice(lattice_words, 0);
  std::vector<std::uint64_t> vertices(vertex_words, 0);
  std::vector<double> mlp(soup::Mlp::kParameters, 0.0);
  std::array<double, 3> loss{};
  for (std::size_t v = 0; v < views.size(); ++v) {
    CAPTURE(v);
    SmallScene alone(*gpu, kTriangles, kFine, {views[v]});
    alone.buffers.reserve_lists(1 << 16);
    const std::size_t first = batch.records[v].pixel_offset, n = alone.buffers.batch().pixels;
    gpu->upload(alone.target.address(),
                std::vector<float>(target.begin() + 3 * first, target.begin() + 3 * (first + n)));
    run(alone);
    const auto colour = floats(alone.buffers.colour, 3 * n), gradient = floats(alone.buffers.gradient, 4 * n);
    CHECK(std::equal(colour.begin(), colour.end(), colours.begin() + 3 * first));
    CHECK(std::equal(gradient.begin(), gradient.end(), gradients.begin() + 4 * first));
    const auto own_lattice = test::lattice_quanta(*gpu, alone.soup, alone.buffers);
    const auto own_vertices = sums(alone.soup.vertex_gradient, vertex_words);
    for (std::size_t i = 0; i < lattice_words; ++i) lattice[i] += own_lattice[i];
    for (std::size_t i = 0; i < vertex_words; ++i) vertices[i] += own_vertices[i];
    const auto own_mlp = mlp_gradient(alone);
    for (std::size_t i = 0; i < soup::Mlp::kParameters; ++i) mlp[i] += own_mlp[i];
    const auto own_loss = losses(alone);
    for (std::size_t i = 0; i < 3; ++i) loss[i] += own_loss[i];
  }
  // Fixed-point sums of the views add up exactly to the sum of the batch.
  CHECK(lattice == test::lattice_quanta(*gpu, together.soup, together.buffers));
  CHECK(vertices == sums(together.soup.vertex_gradient, vertex_words));
  const auto whole_mlp = mlp_gradient(together);
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < soup::Mlp::kParameters; ++i)
    worst = std::max(worst, std::abs(mlp[i] - whole_mlp[i])), largest = std::max(largest, std::abs(mlp[i]));
  CHECK(largest > 0);
  CHECK(worst < 1e-5 * largest);
  const auto whole_loss = losses(together);
  for (std::size_t i = 0; i < 3; ++i) CHECK(loss[i] == Approx(whole_loss[i]).epsilon(1e-9));
  CHECK(whole_loss[0] > 0.05);
  test::require_silence(*gpu);
}

TEST_CASE("a batch without any SSIM window uses only the L1 loss", "[step]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 10, kFine, {test::view_from(0, 10, 40), test::view_from(1, 64, 10)});
  REQUIRE(s.buffers.batch().windows == 0);
  s.train(0, SmallScene::rates(0));
  const std::size_t n = s.buffers.batch().pixels;
  const auto colour = gpu->download_vector<float>(s.buffers.colour.address(), 3 * n),
             target = gpu->download_vector<float>(s.target.address(), 3 * n);
  const auto gradient = gpu->download_vector<float>(s.buffers.gradient.address(), 4 * n);
  double worst = 0;
  for (std::size_t i = 0; i < 3 * n; ++i) {
    const double sign = colour[i] > target[i] ? 1 : colour[i] < target[i] ? -1 : 0;
    worst = std::max(worst, std::abs(gradient[i / 3 * 4 + i % 3] * 3.0 * static_cast<double>(n) - 0.8 * sign));
  }
  CHECK(worst < 1e-6);
  CHECK(all_finite(s.state()));
  test::require_silence(*gpu);
}

TEST_CASE("with the Huber loss, gradients of small errors are proportional and those of larger errors constant",
          "[step]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 10, kFine, {test::view_from(0, 10, 40), test::view_from(1, 64, 10)});
  REQUIRE(s.buffers.batch().windows == 0);  // no SSIM
  constexpr double kHuber = 0.2;
  s.step.begin(1, 0, 0, SmallScene::rates(0), kHuber);
  s.step.visibility(train::Thresholds::half, s.inputs);
  s.step.shade(s.inputs);
  s.step.loss(s.inputs);
  const std::size_t n = s.buffers.batch().pixels;
  const auto colour = gpu->download_vector<float>(s.buffers.colour.address(), 3 * n);
  const auto target = gpu->download_vector<float>(s.target.address(), 3 * n);
  const auto gradient = gpu->download_vector<float>(s.buffers.gradient.address(), 4 * n);
  double worst = 0;
  std::size_t small = 0, large = 0;
  for (std::size_t i = 0; i < 3 * n; ++i) {
    const double error = double(colour[i]) - target[i], pull = std::clamp(error / kHuber, -1.0, 1.0);
    worst = std::max(worst, std::abs(gradient[i / 3 * 4 + i % 3] * 3.0 * static_cast<double>(n) - 0.8 * pull));
    ++(std::abs(error) < kHuber ? small : large);
  }
  CHECK(worst < 1e-6);
  CHECK((small > n / 10 && large > n / 10));
  // Opacity gradients and reports use the plain L1 error.
  for (std::size_t p = 0; p < n; ++p) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(double(colour[3 * p + c]) - target[3 * p + c]);
    worst = std::max(worst, std::abs(gradient[4 * p + 3] - sum));
  }
  CHECK(worst < 1e-6);
  test::require_silence(*gpu);
}

TEST_CASE("degenerate triangles keep all values finite", "[step]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 12, kFine, {test::view_from(0, 48, 48)});
  auto v = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 36);
  v[0] = v[1] = v[2];  // a point
  v[3] = v[4];         // a line
  v[6] = {0.1f, 0, 0}, v[7] = {0.2f, 0, 0}, v[8] = {0.3f, 0, 0};
  v[9] = {NAN, 0, 0};
  v[12] = {INFINITY, 0, 0};
  v[15] = {1.0f, 0, 0};  // at the camera
  v[18] = {3.0f, 0, 0};  // behind it
  v[21] = {0.97f, -50, -50}, v[22] = {0.97f, 50, -50},
  v[23] = {0.97f, 0, 100};  // in front of everything and far outside the image
  v[24] = {1e6f, 0, 0};
  gpu->upload(s.soup.vertices.address(), v);
  s.buffers.reserve_lists(1 << 16);
  for (std::uint32_t i = 0; i < 5; ++i) s.train(i, SmallScene::rates(i));
  const auto colour = gpu->download_vector<float>(s.buffers.colour.address(), 3 * 48 * 48);
  CHECK(all_finite(colour));
  CHECK(all_finite(gpu->download_vector<float>(s.soup.source.address(), s.soup.source_samples * 8)));
  CHECK(all_finite(gpu->download_vector<float>(s.soup.mlp.address(), soup::Mlp::kParameters)));
  const auto after = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 36);
  for (std::size_t i = 0; i < after.size(); ++i)
    if (i != 9 && i != 12) CHECK((std::isfinite(after[i].x) && std::isfinite(after[i].y) && std::isfinite(after[i].z)));
  test::require_silence(*gpu);
}

TEST_CASE("training steps reduce the loss", "[step][same_code]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 60, kFine, {test::view_from(0, 48, 48), test::view_from(1.5, 48, 48)});
  std::vector<float> flat(3ull * s.buffers.batch().pixels, 0.25f);
  gpu->upload(s.target.address(), flat);
  s.inputs.background = glm::vec3(0.25f);
  s.buffers.reserve_lists(1 << 16);
  for (std::uint32_t i = 0; i < 60; ++i) s.train(i, SmallScene::rates(i));
  const auto rows = gpu->download_vector<kernels::Statistics>(s.buffers.statistics.address(), 60);
  const double first = train::fixed_sum(rows[0].l1_low, rows[0].l1_high),
               last = train::fixed_sum(rows[59].l1_low, rows[59].l1_high);
  CAPTURE(first, last);
  CHECK(last < 0.3 * first);
  test::require_silence(*gpu);
}

TEST_CASE("textures without gradients are unchanged, unless every texture is updated", "[step]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kTriangles = 40, kHidden = 7;
  const bool opaque = GENERATE(false, true);  // true: only colours have gradients
  struct After {
    std::vector<float> vertices, source, moment1, moment2, lattice;
  };
  /// The start; after one step; after one step that updates every texture; after one step that reads every gradient.
  std::array<After, 4> after;
  for (int run = 0; run < 4; ++run) {
    SmallScene s(*gpu, kTriangles, kFine, {test::view_from(0, 48, 40), test::view_from(2, 33, 47)});
    s.buffers.reserve_lists(1 << 16);
    // Moves a triangle far above the views of all cameras.
    auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3 * kTriangles);
    for (std::uint32_t k = 0; k < 3; ++k) vertices[3 * kHidden + k].z += 50;
    gpu->upload(s.soup.vertices.address(), vertices);
    const auto fill = [&](const gpu::Buffer& buffer, std::uint64_t n, float value) {
      gpu->upload(buffer.address(), std::vector<float>(n, value));
    };
    // A third of the triangles is almost transparent: no pixel shows them, but they have opacity gradients.
    auto logits = gpu->download_vector<float>(s.soup.source.address(), s.soup.source_samples * 8);
    const std::size_t each = logits.size() / kTriangles;
    for (std::size_t i = 7; i < logits.size(); i += 8)
      if (i / each % 3 == 0) logits[i] = -10.0f;
    gpu->upload(s.soup.source.address(), logits);
    train::Step(*gpu, s.soup, s.buffers).sum_textures();
    fill(s.soup.vertex_moment1, 9 * kTriangles, 0.01f);
    fill(s.soup.vertex_moment2, 3 * kTriangles, 1e-4f);
    fill(s.soup.source_moment1, s.soup.source_samples * 8, 0.01f);
    fill(s.soup.source_moment2, s.soup.source_samples * 8, 1e-4f);
    s.inputs.update_unseen = run == 2;
    s.inputs.opaque = opaque;
    if (run == 3) gpu->upload(s.soup.touched.address(), std::vector<std::uint32_t>(kTriangles, 1));
    if (run > 0) s.train(0, SmallScene::rates(20));
    if (run > 0)
      CHECK(gpu->download_vector<std::uint32_t>(s.soup.touched.address(), kTriangles) ==
            std::vector<std::uint32_t>(kTriangles, 0));
    const auto values = [&](const gpu::Buffer& buffer, std::uint64_t n) {
      return gpu->download_vector<float>(buffer.address(), n);
    };
    after[static_cast<std::size_t>(run)] = {
        values(s.soup.vertices, 9 * kTriangles), values(s.soup.source, s.soup.source_samples * 8),
        values(s.soup.source_moment1, s.soup.source_samples * 8),
        values(s.soup.source_moment2, s.soup.source_samples * 8), values(s.soup.lattice, s.soup.lattice_samples * 8)};
  }
  // of(array, t): the values of triangle t. All triangles have the same number of values.
  const auto of = [&](const std::vector<float>& all, std::uint32_t t) {
    const std::size_t each = all.size() / kTriangles;
    return std::vector<float>(all.begin() + static_cast<std::ptrdiff_t>(t * each),
                              all.begin() + static_cast<std::ptrdiff_t>((t + 1) * each));
  };
  std::uint32_t learnt = 0;
  std::size_t left_alone = 0;  // values without a gradient in textures that have one
  for (const auto member : {&After::source, &After::moment1, &After::moment2, &After::lattice})
    for (std::uint32_t t = 0; t < kTriangles; ++t) {
      CAPTURE(t);
      const auto before = of(after[0].*member, t), some = of(after[1].*member, t), all = of(after[2].*member, t);
      CHECK_FALSE(same_bits(all, before));
      const bool stayed = same_bits(some, before);
      CHECK(same_bits(some, of(after[3].*member, t)));
      if (t == kHidden) CHECK(stayed);
      learnt += !stayed;
      if (stayed || member == &After::lattice) continue;  // a lattice value depends on all levels
      std::size_t alone = 0, neither = 0;
      for (std::size_t i = 0; i < some.size(); ++i) {
        alone += some[i] == before[i] && some[i] != all[i];
        neither += some[i] != before[i] && some[i] != all[i];
      }
      CHECK(neither == 0);
      left_alone += alone;
    }
  CHECK(left_alone > 0);
  CHECK(learnt > (opaque ? 1 : 2) * kTriangles);
  CHECK(same_bits(after[1].vertices, after[2].vertices));  // vertices are updated in both cases
  test::require_silence(*gpu);
}

TEST_CASE("texture and MLP gradients of a whole step match finite differences of its loss", "[step][same_code]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 8, kFine, {test::view_from(0, 40, 40), test::view_from(1, 40, 40)});
  // One target is brighter than every rendered colour and the other one darker. If a colour crossed its target, finite
  // differences would step over the kink of the L1 error.
  auto targets = gpu->download_vector<float>(s.target.address(), 3ull * s.buffers.batch().pixels);
  for (std::size_t i = 0; i < targets.size(); ++i) targets[i] += i < targets.size() / 2 ? 1.0f : -1.0f;
  gpu->upload(s.target.address(), targets);
  s.buffers.reserve_lists(1 << 16);
  std::vector<gpu::Buffer> outputs;
  const auto room = [&](std::uint64_t floats) {
    outputs.push_back(gpu->allocate(floats * 4, "gradient"));
    return outputs.back().address();
  };
  s.inputs.probes.source_gradient = room(s.soup.source_samples * 8);
  s.inputs.probes.mlp_gradient = room(soup::Mlp::kParameters);
  const auto loss = [&] {
    s.step.sum_textures();
    s.step.begin(1, 0, 0, {});
    s.step.visibility(train::Thresholds::half, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    const auto r = gpu->download_vector<kernels::Statistics>(s.buffers.statistics.address(), 1)[0];
    return 0.8 * train::fixed_sum(r.l1_low, r.l1_high) + 0.1 * (1 - train::fixed_sum(r.ssim_low, r.ssim_high));
  };
  loss();
  s.step.backward(s.inputs);
  s.step.update(s.inputs);  // learning rates are 0
  const auto texture = gpu->download_vector<float>(s.inputs.probes.source_gradient, s.soup.source_samples * 8);
  const auto mlp = gpu->download_vector<float>(s.inputs.probes.mlp_gradient, soup::Mlp::kParameters);
  auto weights = gpu->download_vector<float>(s.soup.mlp.address(), soup::Mlp::kParameters);

  // Uses the largest gradient of each channel, because small ones are lost in the rounding of a float image.
  double ab = 0, bb = 0, aa = 0;
  const auto compare = [&](double actual, float& value, gpu::Address address, float h) {
    const float kept = value;
    const auto at = [&](float v) {
      gpu->upload(address, std::as_bytes(std::span(&v, 1)));
      return loss();
    };
    const double expected = (at(kept + h) - at(kept - h)) / (2.0 * h);
    at(kept);
    ab += actual * expected, bb += expected * expected, aa += actual * actual;
    CHECK(actual == Approx(expected).epsilon(0.1).margin(0.02 * std::sqrt(bb)));
  };
  for (int c = 0; c < 7; ++c) {
    std::size_t best = c;
    for (std::size_t i = c; i < texture.size(); i += 8)
      if (std::abs(texture[i]) > std::abs(texture[best])) best = i;
    compare(texture[best], s.logits[best], s.soup.source.address() + 4 * best, 0.05f);
  }
  CHECK(ab / bb == Approx(1).margin(0.03));
  CHECK(ab / std::sqrt(aa * bb) > 0.999);
  ab = aa = bb = 0;
  for (const std::size_t i : {3ul, 40ul, 130ul, 260ul, 300ul, 420ul, 530ul, 550ul, 580ul, 592ul, 594ul})
    compare(mlp[i], weights[i], s.soup.mlp.address() + 4 * i, 0.01f);
  CHECK(ab / bb == Approx(1).margin(0.03));
  CHECK(ab / std::sqrt(aa * bb) > 0.999);
  test::require_silence(*gpu);
}

TEST_CASE("visible pixels of many views are counted in passes of limited memory", "[visibility]") {
  auto gpu = test::open_device();
  std::vector<train::BatchView> views;
  // Small images, because memory depends on triangles per view, and time on triangles per pixel.
  for (int i = 0; i < 24; ++i) views.push_back(test::view_from(0.26 * i, 8, 8));
  constexpr std::uint32_t kTriangles = 24'000;  // all views at once would take 37 MB
  SmallScene s(*gpu, kTriangles, {{0, 0}}, {views[0]});
  const auto together = train::count_visible(*gpu, s.soup, s.buffers, views);
  CHECK(s.buffers.screen.bytes() <= train::kPassScreenBytes);
  std::vector<std::uint32_t> sum(kTriangles);
  for (const train::BatchView& view : views) {
    const auto one = train::count_visible(*gpu, s.soup, s.buffers, std::span(&view, 1));
    for (std::uint32_t t = 0; t < kTriangles; ++t) sum[t] += one[t];
  }
  CHECK(together == sum);
  CHECK(std::accumulate(sum.begin(), sum.end(), 0u) > 0);
  test::require_silence(*gpu);
}

TEST_CASE("the loss has no gradient at pixels equal to the target, and exact gradients next to them", "[step]") {
  auto gpu = test::open_device();
  SmallScene s(*gpu, 20, kFine, {test::view_from(0, 90, 70), test::view_from(1, 40, 57), test::view_from(2, 33, 9)});
  const auto& batch = s.buffers.batch();
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  s.step.shade(s.inputs);
  const auto colour = gpu->download_vector<float>(s.buffers.colour.address(), 3ull * batch.pixels);
  auto target = colour;
  // The differing pixels: one whose windows all start in its own block and reach into three others, four at the corner
  // of another block, and a strip at a border.
  soup::Random random(4);
  for (const auto& [view, x0, y0, x1, y1] :
       {std::array{0u, 44u, 28u, 45u, 29u}, {0u, 79u, 47u, 81u, 49u}, {1u, 0u, 50u, 40u, 57u}})
    for (std::uint32_t y = y0; y < y1; ++y)
      for (std::uint32_t x = x0; x < x1; ++x)
        for (int c = 0; c < 3; ++c)
          target[3 * (batch.records[view].pixel_offset + y * batch.records[view].width + x) + c] = random.uniform01();
  gpu->upload(s.target.address(), target);
  // Fills buffers with other values, because results of an earlier step must not be used.
  gpu->fill(s.buffers.partial.address(), s.buffers.partial.bytes(), 0x3f800000u);
  gpu->fill(s.buffers.gradient.address(), s.buffers.gradient.bytes(), 0x3f800000u);
  s.step.loss(s.inputs);
  const auto gradient = gpu->download_vector<float>(s.buffers.gradient.address(), 4ull * batch.pixels);

  std::vector<double> expected(3ull * batch.pixels, 0.0);
  double ssim = 0, largest = 0;
  for (const kernels::ViewRecord& view : batch.records)
    for (std::uint32_t c = 0; c < 3; ++c) {
      const auto at = [&](std::uint32_t x, std::uint32_t y) {
        return 3 * (view.pixel_offset + y * view.width + x) + c;
      };
      for (std::uint32_t y = 0; y < view.height; ++y)
        for (std::uint32_t x = 0; x < view.width; ++x) {
          const double error = double(colour[at(x, y)]) - target[at(x, y)];
          expected[at(x, y)] += 0.8 / (3.0 * batch.pixels) * (error > 0 ? 1 : error < 0 ? -1 : 0);
          if (x + 10 >= view.width || y + 10 >= view.height) continue;
          double m[4] = {};
          const auto each = [&](auto&& f) {
            for (int j = 0; j < SSIM_TAPS; ++j)
              for (int i = 0; i < SSIM_TAPS; ++i) f(f64::ssim_tap(i) * f64::ssim_tap(j), at(x + i, y + j));
          };
          each([&](double tap, std::size_t p) {
            const double a = colour[p], b = target[p];
            m[0] += tap * a, m[1] += tap * b, m[2] += tap * (a * a + b * b), m[3] += tap * a * b;
          });
          const f64::SsimWindow w = f64::ssim_window(m[0], m[1], m[2], m[3]);
          ssim += w.value / (3.0 * double(batch.windows));
          each([&](double tap, std::size_t p) {
            expected[p] -=
                0.1 / (3.0 * double(batch.windows)) * tap * (w.d_x + 2 * colour[p] * w.d_xx + target[p] * w.d_xy);
          });
        }
    }
  std::size_t none = 0;
  for (std::size_t p = 0; p < batch.pixels; ++p)
    for (int c = 0; c < 3; ++c) {
      largest = std::max(largest, std::abs(expected[3 * p + c]));
      none += gradient[4 * p + c] == 0.0f;
    }
  double worst = 0;
  for (std::size_t p = 0; p < batch.pixels; ++p)
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(gradient[4 * p + c] - expected[3 * p + c]));
  CHECK(worst < 1e-5 * largest);
  CHECK(none > batch.pixels);  // more than a third of all values; otherwise no block was skipped
  const auto r = gpu->download_vector<kernels::Statistics>(s.buffers.statistics.address(), 1)[0];
  CHECK(std::abs(train::fixed_sum(r.ssim_low, r.ssim_high) - ssim) < 1e-6);
  test::require_silence(*gpu);
}
