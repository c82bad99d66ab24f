// Tests engine/train/step/shared_soup.h: any number of ranks gives the same bits as one rank. Ranks are threads, each
// with its own device. The tag [repeats] excludes these tests on drivers that would mostly compile kernels.
#include <catch2/catch.hpp>

#include "base/error.h"
#include "gpu/small_scene.h"
#include "ranks_of_threads.h"
#include "train/start/start_exposures.h"
#include "train/step/photographs.h"
#include "train/step/shared_soup.h"
#include "train/topology/hole_guard.h"
#include "train/topology/importance.h"
#include "train/topology/refine.h"
#include "train/topology/unseen_textures.h"

using namespace trisoup;

namespace {

/// Views with sizes that give blocks and slices of unequal size.
std::vector<train::BatchView> views() {
  return {test::view_from(0.3, 50, 40), test::view_from(2.0, 33, 35), test::view_from(4.0, 16, 9)};
}

/// Assertion for ranks. Catch's assertions are not thread-safe.
void expect(bool holds, const char* what) {
  if (!holds) throw Error("{}", what);
}

/// Moves the second half of the triangles to the positions of the first half. Each pair has equal depth, and with
/// several ranks belongs to different ranks.
void make_ties(test::SmallScene& scene) {
  const std::uint64_t half = scene.soup.triangles / 2 * 36ull;
  scene.gpu.copy(scene.soup.vertices.address() + half, scene.soup.vertices.address(), half);
}

/// Returns all parameters and moments after `steps` steps with one rank.
std::vector<float> alone(std::uint32_t triangles, std::vector<soup::TextureLevels> levels, std::uint32_t steps,
                         bool ties = false) {
  auto gpu = test::open_own_device();
  test::SmallScene scene(*gpu, triangles, std::move(levels), views());
  if (ties) make_ties(scene);
  for (std::uint32_t i = 0; i < steps; ++i) scene.train(i, test::SmallScene::rates(i));
  return scene.state();
}

}  // namespace

TEST_CASE("all triangles are divided between ranks in order, by the size of their textures", "[ranks][repeats]") {
  std::vector<soup::TextureLevels> levels(100, {2, 5});
  std::fill_n(levels.begin(), 60, soup::TextureLevels{2, 2});
  const auto table = soup::make_texture_table(levels).entries;
  for (const int ranks : {1, 2, 3, 7, 64}) {
    const auto ranges = train::divided(table, ranks);
    REQUIRE(ranges.size() == static_cast<std::size_t>(ranks));
    std::uint32_t next = 0;
    std::uint64_t max_samples = 0, all = 0;
    for (const train::TriangleRange& range : ranges) {
      CHECK(range.first == next);
      next = range.last;
      std::uint64_t samples = 0;
      for (std::uint32_t t = range.first; t < range.last; ++t)
        samples += soup::samples_in(table[t].level_min, table[t].level_max);
      max_samples = std::max(max_samples, samples), all += samples;
    }
    CHECK(next == 100);
    CHECK(max_samples <= all / static_cast<std::uint64_t>(ranks) + soup::samples_in(2, 5));
  }
  CHECK(train::divided({}, 3)[2].count() == 0);
}

TEST_CASE("one rank and several ranks give the same bits", "[ranks][repeats]") {
  const std::vector<soup::TextureLevels> levels{{0, 0}, {2, 3}, {2, 5}, {2, 2}};
  constexpr std::uint32_t kSteps = 4;
  const std::uint32_t triangles = GENERATE(2u, 60u);
  const bool ties = GENERATE(false, true);
  const std::vector<float> expected = alone(triangles, levels, kSteps, ties);
  for (const int size : {1, 2, 3, 4}) {
    std::vector<std::vector<float>> states(static_cast<std::size_t>(size));
    std::vector<std::uint64_t> bytes(static_cast<std::size_t>(size));
    const auto thrown = test::run_as_ranks(size, [&](ranks::Ranks& ranks) {
      auto gpu = test::open_own_device();
      test::SmallScene scene(*gpu, triangles, levels, views(), 1, &ranks);
      if (ties) make_ties(scene);
      for (std::uint32_t i = 0; i < kSteps; ++i) {
        scene.train(i, test::SmallScene::rates(i));
        expect(scene.shared->outcome() == train::SharedSoup::Outcome::done, "a step is not done");
      }
      bytes[static_cast<std::size_t>(ranks.rank())] =
          scene.soup.source.bytes() + scene.soup.source_moment1.bytes() + scene.soup.lattice.bytes();
      states[static_cast<std::size_t>(ranks.rank())] = scene.state();
      scene.shared->compare();
    });
    CHECK(thrown == std::vector<std::string>(static_cast<std::size_t>(size)));
    for (const auto& state : states) CHECK((state == expected));  // parentheses avoid printing thousands of floats
    if (triangles < 60) continue;
    // The memory of a rank is its share, up to the size of one triangle.
    std::uint64_t all = 0, largest = 64 * soup::samples_in(2, 5) + 32 * soup::samples_at(5);
    for (const std::uint64_t b : bytes) all += b;
    for (const std::uint64_t b : bytes) CHECK(b <= all / static_cast<std::uint64_t>(size) + largest);
  }
}

TEST_CASE("one rank and several ranks measure and paint the same", "[ranks][repeats]") {
  std::vector<train::BatchView> seen = views();
  std::vector<Image> images;
  soup::Random random(9);
  for (std::uint32_t v = 0; v < seen.size(); ++v) {
    images.push_back({static_cast<int>(seen[v].width), static_cast<int>(seen[v].height), {}});
    for (std::uint32_t i = 0; i < 4 * seen[v].width * seen[v].height; ++i)
      images.back().rgba.push_back(i % 4 == 3 ? 255
                                              : static_cast<std::uint8_t>(random.uniform(40, 90 + 40 * double(v))));
  }
  struct Found {
    train::Importance importance;
    std::vector<std::uint32_t> kept;
    std::vector<float> painted, filled;
    std::vector<soup::ExposureGrid> exposures;
    bool operator==(const Found& o) const {
      return importance.error == o.importance.error && importance.pixels == o.importance.pixels &&
             importance.triangle == o.importance.triangle && importance.finest == o.importance.finest &&
             importance.behind == o.importance.behind && kept == o.kept && painted == o.painted && filled == o.filled &&
             exposures == o.exposures;
    }
  };
  const auto find = [&](ranks::Ranks* ranks) {
    auto gpu = test::open_own_device();
    const train::Photographs photographs = train::upload_photographs(*gpu, images);
    std::vector<train::BatchView> with_photographs = seen;
    for (std::uint32_t v = 0; v < seen.size(); ++v)
      with_photographs[v].photo = photographs.addresses[v], with_photographs[v].index = v;
    test::SmallScene fine(*gpu, 40, {{0, 0}, {2, 3}, {2, 5}, {2, 2}}, with_photographs, 1, ranks);
    Found found;
    found.importance =
        train::measure_importance(*gpu, fine.soup, fine.buffers, glm::vec3(0.5f), with_photographs, nullptr, 2);
    for (std::uint32_t t = 0; t < 40; t += 3) found.kept.push_back(t);
    std::vector<bool> backdrop(40);
    for (std::uint32_t t = 20; t < 30; ++t) backdrop[t] = true;
    train::guard_holes(*gpu, fine.soup, fine.buffers, with_photographs, backdrop, 40, found.kept);
    test::SmallScene coarse(*gpu, 40, {{0, 0}}, with_photographs, 2, ranks);
    train::Settings settings;
    settings.samples_per_pixel = 1;
    settings.level_max = 4;
    found.exposures = train::start_exposures(*gpu, coarse.soup, coarse.buffers, with_photographs);
    train::paint(*gpu, coarse.soup, coarse.buffers, {with_photographs, with_photographs}, nullptr, settings);
    found.painted = coarse.state();
    train::fill_unseen(*gpu, fine.soup, fine.buffers, with_photographs);
    found.filled = fine.state();
    return found;
  };
  const Found expected = find(nullptr);
  REQUIRE(expected.importance.behind.size() > 10);
  REQUIRE(expected.kept.size() > 14);
  REQUIRE(expected.exposures.front() != soup::ExposureGrid());
  for (const int size : {2, 3}) {
    std::vector<Found> found(static_cast<std::size_t>(size));
    const auto thrown = test::run_as_ranks(
        size, [&](ranks::Ranks& ranks) { found[static_cast<std::size_t>(ranks.rank())] = find(&ranks); });
    CHECK(thrown == std::vector<std::string>(static_cast<std::size_t>(size)));
    for (const Found& of_rank : found) CHECK((of_rank == expected));
  }
}

TEST_CASE("if lists do not fit on one rank, no rank completes the step", "[ranks][repeats]") {
  constexpr std::uint32_t kTriangles = 60;
  const std::vector<float> expected = alone(kTriangles, {{2, 4}}, 2);
  std::vector<std::vector<float>> states(3);
  std::vector<int> again(3);
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    const auto self = static_cast<std::size_t>(ranks.rank());
    auto gpu = test::open_own_device();
    test::SmallScene scene(*gpu, kTriangles, {{2, 4}}, views(), 1, &ranks);
    if (self == 1) {
      scene.buffers.lists = {};
      scene.buffers.reserve_lists(4);
    }
    for (std::uint32_t i = 0; i < 2;) {
      scene.train(i, test::SmallScene::rates(i));
      if (scene.shared->outcome() == train::SharedSoup::Outcome::done)
        ++i;
      else
        ++again[self], train::grow_lists_if_needed(*gpu, scene.buffers);
    }
    states[self] = scene.state();
    scene.shared->ask_to_stop(self == 2);
    scene.train(2, test::SmallScene::rates(2));
    expect(scene.shared->outcome() == train::SharedSoup::Outcome::stopped, "one is asked to stop, and not all do");
    expect(scene.state() == states[self], "a step that is not taken has changed something");
  });
  CHECK(thrown == std::vector<std::string>(3));
  CHECK(again == std::vector<int>{1, 1, 1});
  for (const auto& state : states) CHECK((state == expected));  // parentheses avoid printing thousands of floats
}

TEST_CASE("different results on the devices of ranks are detected", "[ranks][repeats]") {
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    auto gpu = test::open_own_device();
    test::SmallScene scene(*gpu, 20, {{2, 3}}, views(), 1, &ranks);
    if (ranks.rank() == 2) {
      const float off = 1e-7f;
      gpu->upload(scene.soup.mlp.address(), std::as_bytes(std::span(&off, 1)));
    }
    scene.train(0, test::SmallScene::rates(0));
    scene.shared->compare();
  });
  for (const std::string& what : thrown) CHECK(what.find("rank 2 of 3: its vertices or MLP") != std::string::npos);
}
