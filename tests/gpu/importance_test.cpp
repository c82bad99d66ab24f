// Tests engine/train/topology/importance.h against the increase in error after one triangle or one level is removed.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "gpu/small_scene.h"
#include "train/step/photographs.h"
#include "train/topology/importance.h"
#include "train/topology/refine.h"

using namespace trisoup;

namespace {

constexpr std::uint32_t kImportanceSide = 40;

/// Photographs of noise with some masked pixels.
scene::Scene noise(std::size_t views, soup::Random& random) {
  scene::Scene scene;
  for (std::size_t v = 0; v < views; ++v) {
    scene::View view;
    view.camera.width = view.camera.height = kImportanceSide;
    view.image = {kImportanceSide, kImportanceSide, {}};
    for (std::uint32_t p = 0; p < kImportanceSide * kImportanceSide; ++p)
      for (int c = 0; c < 4; ++c)
        view.image.rgba.push_back(
            c == 3 && p % 7 != 0 ? 255 : static_cast<std::uint8_t>(random.uniform01() * (c < 3 ? 255.0f : 100.0f)));
    scene.train.push_back(std::move(view));
  }
  scene.background = glm::vec3(0.25f, 0.5f, 0.75f);
  return scene;
}

/// The weight of each pixel as defined in importance.h, in double: 0.5 plus 0.5 times a term for low contrast.
std::vector<double> error_weights(const Image& photograph) {
  const auto grey = [&](int x, int y) {
    const std::uint8_t* rgba = &photograph.rgba[4 * static_cast<std::size_t>(y * photograph.width + x)];
    return rgba[3] < 128 ? -1.0 : (0.299 * rgba[0] + 0.587 * rgba[1] + 0.114 * rgba[2]) / 255.0;
  };
  std::vector<double> weights;
  double total = 0, inside = 0;
  for (int y = 0; y < photograph.height; ++y)
    for (int x = 0; x < photograph.width; ++x) {
      double count = 0, sum = 0, squares = 0;
      for (int v = std::max(0, y - 3); v <= std::min(photograph.height - 1, y + 3); ++v)
        for (int u = std::max(0, x - 3); u <= std::min(photograph.width - 1, x + 3); ++u)
          if (const double g = grey(u, v); g >= 0) count += 1, sum += g, squares += g * g;
      const bool measured = grey(x, y) >= 0;
      weights.push_back(measured ? 1 / (2 * std::max(0.0, squares / count - sum * sum / (count * count)) + 0.03 * 0.03)
                                 : 0);
      total += weights.back(), inside += measured;
    }
  for (double& w : weights)
    if (w > 0) w = 0.5 + 0.5 * w * inside / total;
  return weights;
}

/// Triangles that are hidden in a rendering, [T] 0 or 1; empty: none.
using Hidden = std::vector<std::uint32_t>;

/// Sums of the weighted squared errors of pixels, by the triangle in `winners`.
std::vector<double> errors_by_winner(test::SmallScene& s, const scene::Scene& scene,
                                     std::vector<std::uint32_t>& winners, bool first, const Hidden& hidden = {}) {
  std::vector<double> sums(s.soup.triangles);
  const gpu::Buffer flags = s.gpu.allocate(4ull * s.soup.triangles, "hidden triangles");
  s.gpu.upload(flags.address(), hidden);
  train::StepInputs inputs;
  inputs.background = scene.background;
  inputs.hidden = hidden.empty() ? 0 : flags.address();
  std::size_t base = 0;
  train::for_each_batch(s.gpu, s.soup, s.buffers, s.views, true, inputs, 1, [&](std::size_t view, std::size_t) {
    const auto hits = s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), kImportanceSide * kImportanceSide);
    const auto colour = s.gpu.download_vector<float>(s.buffers.colour.address(), 3 * kImportanceSide * kImportanceSide);
    const std::vector<double> weights = error_weights(scene.train[view].image);
    for (std::uint32_t p = 0; p < kImportanceSide * kImportanceSide; ++p) {
      if (first) winners.push_back(hits[p].triangle);
      const auto& rgba = scene.train[view].image.rgba;
      if (winners[base + p] == 0) continue;
      for (int c = 0; c < 3; ++c)
        sums[winners[base + p] - 1] += weights[p] * std::pow(double(colour[3 * p + c]) - rgba[4 * p + c] / 255.0, 2);
    }
    base += kImportanceSide * kImportanceSide;
  });
  return sums;
}

}  // namespace

TEST_CASE("importance is the increase in error without a triangle or its finest level", "[importance][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(5);
  const scene::Scene scene = noise(3, random);
  std::vector<train::BatchView> views;
  const train::Photographs photographs = train::upload_photographs(*gpu, scene.train);
  for (std::uint32_t v = 0; v < 3; ++v) {
    views.push_back(test::view_from(2.1 * v, kImportanceSide, kImportanceSide));
    views.back().photo = photographs.addresses[v];
    views.back().index = v;
  }
  test::SmallScene s(*gpu, 24, {{2, 4}, {0, 0}, {3, 3}, {1, 1}, {0, 2}}, views);
  const std::vector<float> before = s.state();
  const auto opacity = gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples);
  const train::Importance importance =
      train::measure_importance(*gpu, s.soup, s.buffers, scene.background, views, nullptr, 2);
  CHECK(s.state() == before);
  CHECK(gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples) == opacity);

  std::vector<std::uint32_t> winners;
  const std::vector<double> whole = errors_by_winner(s, scene, winners, true);
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t)
    CHECK(importance.pixels[t] == static_cast<std::uint32_t>(std::count(winners.begin(), winners.end(), t + 1)));
  // Pixels without a triangle have errors too, because the background differs from the photograph.
  CHECK(importance.error > std::accumulate(whole.begin(), whole.end(), 0.0));
  std::set<std::pair<std::uint32_t, std::uint32_t>> behind;
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    CAPTURE(t);
    Hidden alone(s.soup.triangles);
    alone[t] = 1;
    CHECK(importance.triangle[t] ==
          Approx(errors_by_winner(s, scene, winners, false, alone)[t] - whole[t]).margin(1e-4));
    std::vector<std::uint32_t> without;
    errors_by_winner(s, scene, without, true, alone);
    for (std::size_t p = 0; p < winners.size(); ++p)
      if (winners[p] == t + 1 && without[p] != 0) behind.insert({t, without[p] - 1});
    if (whole[t] == 0) CHECK(importance.triangle[t] == 0);
  }
  REQUIRE(behind.size() > 10);
  CHECK(importance.behind == std::vector<std::pair<std::uint32_t, std::uint32_t>>(behind.begin(), behind.end()));

  // Removes all finest levels at once, as pruning does.
  train::Pruned pruned;
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    const soup::TextureEntry& row = s.soup.table[t];
    const std::uint32_t level = std::max(row.level_max, 1u) - 1;
    pruned.kept.push_back(t);
    pruned.levels.push_back({std::min(row.level_min, level), level});
  }
  train::Settings settings;
  train::prune(*gpu, s.soup, s.buffers, pruned, settings);
  const std::vector<double> coarser = errors_by_winner(s, scene, winners, false);
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    CAPTURE(t);
    CHECK(importance.finest[t] == Approx(coarser[t] - whole[t]).margin(1e-4));
  }
  test::require_silence(*gpu);
}

TEST_CASE("all pairs of a thousand triangles are found, each once", "[importance][each_driver]") {
  auto gpu = test::open_device();
  // More pairs than the initial table can store. Each pair appears at two pixels.
  constexpr std::uint32_t kPixels = 20'000, kTriangles = 3;
  std::vector<kernels::Hit> first(kPixels), behind(kPixels);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> expected;
  for (std::uint32_t p = 0; p < kPixels; ++p) {
    first[p].triangle = p / 2 % 500 + 1, behind[p].triangle = p / 1000 + 1;
    expected.emplace_back(first[p].triangle - 1, behind[p].triangle - 1);
  }
  first[7].triangle = 0,
  behind[9].triangle = 0;  // no triangle, none behind; their pairs also appear at the neighbouring pixel
  const gpu::Buffer a = gpu->allocate(16ull * kPixels, "first"), b = gpu->allocate(16ull * kPixels, "behind");
  gpu->upload(a.address(), first);
  gpu->upload(b.address(), behind);
  train::PairSet pairs(*gpu, kTriangles);
  pairs.add(a.address(), b.address(), kPixels / 2);
  pairs.add(a.address(), b.address(), kPixels);
  std::sort(expected.begin(), expected.end());
  expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
  REQUIRE(expected.size() == kPixels / 2);
  CHECK(pairs.take() == expected);
  test::require_silence(*gpu);
}

TEST_CASE("errors in areas of low contrast have more weight, and masked pixels have none",
          "[importance][each_driver]") {
  auto gpu = test::open_device();
  // The left part is a uniform wall and the right part alternates between black and white. The last row is not in the
  // loss. The soup is not visible, so the background is compared with the photograph.
  constexpr int kWide = 60, kHigh = 30;
  const auto worth_of = [&](int wall, int first_row, int rows, int shade = 90) {
    scene::View view;
    view.image = {kWide, kHigh, {}};
    for (int y = 0; y < kHigh; ++y)
      for (int x = 0; x < kWide; ++x) {
        const bool in_rows = y >= first_row && y < first_row + rows;
        const auto grey = static_cast<std::uint8_t>(x < wall ? shade : (x + y) % 2 ? 255 : 0);
        view.image.rgba.insert(view.image.rgba.end(), {grey, grey, grey, static_cast<std::uint8_t>(in_rows ? 255 : 0)});
      }
    const std::vector<double> weights = error_weights(view.image);
    const train::Photographs photographs = train::upload_photographs(*gpu, std::vector<scene::View>{view});
    std::vector<train::BatchView> views{test::view_from(0, kWide, kHigh)};
    views[0].photo = photographs.addresses[0];
    test::SmallScene s(*gpu, 1, {{0, 0}}, views);
    gpu->upload(s.soup.vertices.address(),
                std::vector<glm::vec3>{{0.2f, 90, 90}, {0.2f, 90, 90}, {0.2f, 90, 90}});  // out of sight
    const glm::vec3 background = shade == 90 ? glm::vec3(0.25f, 0.5f, 0.75f) : glm::vec3(0.0f);
    double expected = 0;
    for (std::size_t p = 0; p < weights.size(); ++p)
      for (int c = 0; c < 3; ++c)
        expected += weights[p] * std::pow(double(background[c]) - view.image.rgba[4 * p] / 255.0, 2);
    const double error = train::measure_importance(*gpu, s.soup, s.buffers, background, views, nullptr, 1).error;
    CHECK(error == Approx(expected).epsilon(1e-4));
    return error;
  };
  const double mixed = worth_of(kWide / 2, 0, kHigh - 1), wall = worth_of(kWide, 0, kHigh - 1),
               turns = worth_of(0, 0, kHigh - 1);
  CHECK(wall < mixed);          // the wall has a small error
  CHECK(mixed < 0.75 * turns);  // next to a wall, alternating pixels have half the weight
  CHECK(worth_of(kWide / 2, 0, 0) == 0);
  worth_of(16, 0, kHigh, 255);  // a white block on black has the largest possible error
  test::require_silence(*gpu);
}
