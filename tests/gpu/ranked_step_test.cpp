// Tests engine/train/ranked_step.h: that any number of ranks trains the same bits as one, with threads as ranks, each with a device of its own ([repeats]:
// on a driver that would be compiling most of the time).
#include <catch2/catch.hpp>

#include "error.h"
#include "gpu/small_scene.h"
#include "ranks_of_threads.h"
#include "train/ranked_step.h"

using namespace trisoup;

namespace {

/// Views of sizes that leave blocks and slices of uneven size.
std::vector<train::BatchView> views() { return {test::view_from(0.3, 50, 40), test::view_from(2.0, 33, 35), test::view_from(4.0, 16, 9)}; }

/// What a rank checks: assertions of the test's own are for one thread alone.
void expect(bool holds, const char* what) {
  if (!holds) throw Error("{}", what);
}

/// Every parameter and moment after `steps` steps of one rank.
std::vector<float> alone(std::uint32_t triangles, std::vector<soup::TextureLevels> levels, std::uint32_t steps) {
  auto gpu = test::open_device();
  test::SmallScene scene(*gpu, triangles, std::move(levels), views());
  for (std::uint32_t i = 0; i < steps; ++i) scene.train(i, test::SmallScene::rates(i));
  return scene.state();
}

}  // namespace

TEST_CASE("triangles are divided by the bytes of their textures, all of them, in order", "[ranks][repeats]") {
  std::vector<soup::TextureLevels> levels(100, {2, 5});
  std::fill_n(levels.begin(), 60, soup::TextureLevels{2, 2});
  const auto table = soup::make_texture_table(levels).entries;
  for (const int ranks : {1, 2, 3, 7, 64}) {
    const auto ranges = train::divided(table, ranks);
    REQUIRE(ranges.size() == static_cast<std::size_t>(ranks));
    std::uint32_t next = 0;
    std::uint64_t most = 0, all = 0;
    for (const train::TriangleRange& range : ranges) {
      CHECK(range.first == next);
      next = range.last;
      std::uint64_t samples = 0;
      for (std::uint32_t t = range.first; t < range.last; ++t) samples += soup::samples_in(table[t].level_min, table[t].level_max);
      most = std::max(most, samples), all += samples;
    }
    CHECK(next == 100);
    CHECK(most <= all / static_cast<std::uint64_t>(ranks) + soup::samples_in(2, 5));
  }
  CHECK(train::divided({}, 3)[2].count() == 0);
}

TEST_CASE("one rank and several train the same bits", "[ranks][repeats]") {
  const std::vector<soup::TextureLevels> levels{{0, 0}, {2, 3}, {2, 5}, {2, 2}};
  constexpr std::uint32_t kSteps = 4;
  const std::uint32_t triangles = GENERATE(2u, 60u);
  const std::vector<float> expected = alone(triangles, levels, kSteps);
  for (const int size : {1, 2, 3, 4}) {
    std::vector<std::vector<float>> states(static_cast<std::size_t>(size));
    std::vector<std::uint64_t> sent(static_cast<std::size_t>(size));
    const auto thrown = test::run_as_ranks(size, [&](ranks::Ranks& ranks) {
      auto gpu = test::open_device();
      test::SmallScene scene(*gpu, triangles, levels, views());
      train::RankedStep step(*gpu, scene.soup, scene.frame, ranks);
      for (std::uint32_t i = 0; i < kSteps; ++i) {
        scene.step.begin(i * 7919u + 1u, i, i, test::SmallScene::rates(i));
        expect(step.train(scene.inputs, false) == train::RankedStep::Outcome::done, "a step is not done");
      }
      step.gather(true);
      sent[static_cast<std::size_t>(ranks.rank())] = ranks.bytes_sent();
      step.gather(true);
      expect(ranks.bytes_sent() == sent[static_cast<std::size_t>(ranks.rank())], "what has not changed is sent again");
      states[static_cast<std::size_t>(ranks.rank())] = scene.state();
    });
    CHECK(thrown == std::vector<std::string>(static_cast<std::size_t>(size)));
    for (const auto& state : states) CHECK(state == expected);
  }
}

TEST_CASE("lists that do not fit on one rank let no rank take the step", "[ranks][repeats]") {
  constexpr std::uint32_t kTriangles = 60;
  const std::vector<float> expected = alone(kTriangles, {{2, 4}}, 2);
  std::vector<std::vector<float>> states(3);
  std::vector<int> again(3);
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    const auto self = static_cast<std::size_t>(ranks.rank());
    auto gpu = test::open_device();
    test::SmallScene scene(*gpu, kTriangles, {{2, 4}}, views());
    if (self == 1) {
      scene.frame.lists = {};
      scene.frame.reserve_lists(4);
    }
    train::RankedStep step(*gpu, scene.soup, scene.frame, ranks);
    for (std::uint32_t i = 0; i < 2;) {
      scene.step.begin(i * 7919u + 1u, i, i, test::SmallScene::rates(i));
      if (step.train(scene.inputs, false) == train::RankedStep::Outcome::done) ++i;
      else ++again[self], train::grow_lists_if_needed(*gpu, scene.frame);
    }
    step.gather(true);
    states[self] = scene.state();
    expect(step.train(scene.inputs, self == 2) == train::RankedStep::Outcome::stopped, "one is asked to stop, and not all do");
    expect(scene.state() == states[self], "a step that is not taken has changed something");
  });
  CHECK(thrown == std::vector<std::string>(3));
  CHECK(again == std::vector<int>{1, 1, 1});
  for (const auto& state : states) CHECK(state == expected);
}

TEST_CASE("ranks whose devices do not compute the same are found out", "[ranks][repeats]") {
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    auto gpu = test::open_device();
    test::SmallScene scene(*gpu, 20, {{2, 3}}, views());
    if (ranks.rank() == 2) {
      const float off = 1e-7f;
      gpu->upload(scene.soup.mlp.address(), std::as_bytes(std::span(&off, 1)));
    }
    train::RankedStep step(*gpu, scene.soup, scene.frame, ranks);
    scene.step.begin(1, 0, 0, test::SmallScene::rates(0));
    step.train(scene.inputs, false);
    step.gather(false);
  });
  for (const std::string& what : thrown) CHECK(what.find("rank 2 of 3: its vertices or MLP") != std::string::npos);
}
