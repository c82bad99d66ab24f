// Tests engine/train/worth.h: against what pictures lose when one triangle, or one level, really goes.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "gpu/small_scene.h"
#include "train/hidden.h"
#include "train/photographs.h"
#include "train/resample.h"
#include "train/worth.h"

using namespace trisoup;

namespace {

constexpr std::uint32_t kSide = 40;

/// Photographs of noise, some pixels of which are masked out.
scene::Scene noise(std::size_t views, soup::Random& random) {
  scene::Scene scene;
  for (std::size_t v = 0; v < views; ++v) {
    scene::View view;
    view.camera.width = view.camera.height = kSide;
    view.image = {kSide, kSide, {}};
    for (std::uint32_t p = 0; p < kSide * kSide; ++p)
      for (int c = 0; c < 4; ++c) view.image.rgba.push_back(c == 3 && p % 7 != 0 ? 255 : static_cast<std::uint8_t>(random.uniform01() * (c < 3 ? 255.0f : 100.0f)));
    scene.train.push_back(std::move(view));
  }
  scene.background = glm::vec3(0.25f, 0.5f, 0.75f);
  return scene;
}

/// Squared error of all pixels, each times its weight, by the triangle that wins them in `winners`.
std::vector<double> errors_by_winner(test::SmallScene& s, const scene::Scene& scene, std::vector<std::uint32_t>& winners, bool first) {
  std::vector<double> sums(s.soup.triangles);
  train::StepInputs inputs;
  inputs.background = scene.background;
  std::size_t base = 0;
  train::for_each_batch(s.gpu, s.soup, s.frame, s.views, true, inputs, 1, [&](std::size_t view, std::size_t) {
    const auto hits = s.gpu.download_vector<kernels::Hit>(s.frame.hits.address(), kSide * kSide);
    const auto colour = s.gpu.download_vector<float>(s.frame.colour.address(), 3 * kSide * kSide);
    const std::vector<float> weights = train::error_weights(scene.train[view].image);
    for (std::uint32_t p = 0; p < kSide * kSide; ++p) {
      if (first) winners.push_back(hits[p].triangle);
      const auto& rgba = scene.train[view].image.rgba;
      if (winners[base + p] == 0 || rgba[4 * p + 3] < 128) continue;
      for (int c = 0; c < 3; ++c) sums[winners[base + p] - 1] += double(weights[p]) * std::pow(double(colour[3 * p + c]) - rgba[4 * p + c] / 255.0, 2);
    }
    base += kSide * kSide;
  });
  return sums;
}

}  // namespace

TEST_CASE("worth is what pictures lose when a triangle or its finest level goes", "[worth][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(5);
  const scene::Scene scene = noise(3, random);
  std::vector<train::BatchView> views;
  const train::Photographs photographs = train::upload_photographs(*gpu, scene.train);
  for (std::uint32_t v = 0; v < 3; ++v) {
    views.push_back(test::view_from(2.1 * v, kSide, kSide));
    views.back().photo = photographs.addresses[v];
    views.back().index = v;
  }
  test::SmallScene s(*gpu, 24, {{2, 4}, {0, 0}, {3, 3}, {1, 1}, {0, 2}}, views);
  const std::vector<float> before = s.state();
  const auto opacity = gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples);
  const train::Worth worth = train::measure_worth(*gpu, s.soup, s.frame, scene, views, nullptr, 2);
  CHECK(s.state() == before);
  CHECK(gpu->download_vector<float>(s.soup.opacity.address(), s.soup.lattice_samples) == opacity);

  std::vector<std::uint32_t> winners;
  const std::vector<double> whole = errors_by_winner(s, scene, winners, true);
  CHECK(std::all_of(whole.begin(), whole.end(), [&, t = 0u](double) mutable {
    const auto shown = std::count(winners.begin(), winners.end(), t + 1);
    return worth.pixels[t++] == static_cast<std::uint32_t>(shown);
  }));
  // Where no triangle is the background is wrong as well.
  CHECK(worth.error > std::accumulate(whole.begin(), whole.end(), 0.0));
  // A triangle behind may be hidden in the same turn: few, and the sum over all says whether it is right.
  double sum = 0, expected = 0;
  std::size_t exact = 0, seen = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> behind;
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    std::vector<bool> alone(s.soup.triangles);
    alone[t] = true;
    train::hide(*gpu, s.soup, alone);
    const double loss = errors_by_winner(s, scene, winners, false)[t] - whole[t];
    std::vector<std::uint32_t> without;
    errors_by_winner(s, scene, without, true);
    for (std::size_t p = 0; p < winners.size(); ++p)
      if (winners[p] == t + 1 && without[p] != 0) behind.insert({t, without[p] - 1});
    s.step.sum_textures();
    sum += worth.triangle[t], expected += loss;
    seen += whole[t] > 0;
    exact += whole[t] > 0 && std::abs(worth.triangle[t] - loss) < 1e-3;
    if (whole[t] == 0) CHECK(worth.triangle[t] == 0);
  }
  CHECK(exact >= seen * 2 / 3);
  const std::set<std::pair<std::uint32_t, std::uint32_t>> told(worth.behind.begin(), worth.behind.end());
  CHECK(std::is_sorted(worth.behind.begin(), worth.behind.end()));
  CHECK(told.size() == worth.behind.size());
  REQUIRE(behind.size() > 10);
  CHECK(std::count_if(behind.begin(), behind.end(), [&](const auto& pair) { return told.contains(pair); }) >= std::ptrdiff_t(behind.size() * 2 / 3));
  CHECK(sum == Approx(expected).epsilon(0.15));

  // All finest levels at once, as a change of topology takes them away.
  train::Shrunk shrunk;
  std::vector<double> finest = worth.finest;
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    const soup::TextureEntry& row = s.soup.table[t];
    const std::uint32_t level = std::max(row.level_max, 1u) - 1;
    shrunk.kept.push_back(t);
    shrunk.levels.push_back({std::min(row.level_min, level), level});
  }
  train::Settings settings;
  train::shrink(*gpu, s.soup, s.frame, shrunk, settings);
  const std::vector<double> coarser = errors_by_winner(s, scene, winners, false);
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    CAPTURE(t);
    CHECK(finest[t] == Approx(coarser[t] - whole[t]).margin(1e-4));
  }
  test::require_silence(*gpu);
}

TEST_CASE("errors where there is little contrast count for more, and those outside of the loss for nothing", "[worth]") {
  // Left a wall, right black and white by turns; the last row is not in the loss.
  constexpr int kWide = 60, kHigh = 30;
  Image photograph{kWide, kHigh, {}};
  for (int y = 0; y < kHigh; ++y)
    for (int x = 0; x < kWide; ++x) {
      const auto grey = static_cast<std::uint8_t>(x < kWide / 2 ? 90 : (x + y) % 2 ? 255 : 0);
      photograph.rgba.insert(photograph.rgba.end(), {grey, grey, grey, static_cast<std::uint8_t>(y == kHigh - 1 ? 0 : 255)});
    }
  const std::vector<float> weights = train::error_weights(photograph);
  const auto at = [&](int x, int y) { return weights[static_cast<std::size_t>(y * kWide + x)]; };
  double sum = 0;
  for (const float w : weights) sum += w;
  CHECK(sum == Approx(kWide * (kHigh - 1)));
  for (int x = 0; x < kWide; ++x) CHECK(at(x, kHigh - 1) == 0);
  // By hand: 1 / C2 on the wall, 1 / (2 * 0.25 + C2) among the pixels that take turns; each is half of the pixels but for the border.
  const double wall = 1 / 0.0009, turns = 1 / 0.5009, shares = 26.0 / 30.0;
  CHECK(at(5, 10) == Approx(at(20, 3)));
  CHECK((at(5, 10) - 0.5) / (at(50, 10) - 0.5) == Approx(wall / turns).epsilon(0.01));
  CHECK(at(5, 10) < 0.5 + 1.0 / shares + 0.1);
  CHECK(at(5, 10) > 0.5 + 0.9);
}
