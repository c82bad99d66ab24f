// Tests engine/train/topology/simplify.h and engine/scene/hold_out.h: order of removal, end of the rounds, choice of
// validation views.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "scene/hold_out.h"
#include "soup/texture_table.h"
#include "train/config/schedule.h"
#include "train/topology/simplify.h"

using namespace trisoup;
using namespace trisoup::train;

namespace {

std::vector<soup::TextureEntry> table_of(const std::vector<soup::TextureLevels>& levels) {
  return soup::make_texture_table(levels).entries;
}

/// Simulates the rounds of a training: n halvings of the bytes cost 0.15 n^curve dB, and each removal takes 10 % more
/// or less than requested.
std::vector<Round> simulate(const Settings& s, double best_psnr, double curve = 2) {
  std::vector<Round> rounds{{s.steps, 8'000'000, 5000, best_psnr, 0.9}};
  double wobble = 0.1;
  while (const auto next = next_round(rounds, s)) {
    const Shares shares = next->shares;
    Round r = rounds.at(next->from);
    r.from = next->from;
    r.smaller = shares != Shares{};
    r.step += s.round_steps;
    r.triangles = static_cast<std::uint32_t>(r.triangles * std::min(shares.triangles, 0.5 + 0.5 * shares.bytes));
    r.bytes = static_cast<std::uint64_t>(
        double(r.bytes) *
        std::min(r.smaller ? 1 - (1 - shares.bytes) * (1 + (wobble = -wobble)) : 1.001, shares.triangles));
    const double halvings = std::log2(8e6 / double(r.bytes));
    r.psnr = best_psnr - 0.15 * std::pow(std::max(0.0, halvings), curve);
    r.ssim = 1 - 0.1 * std::exp2(0.1 * halvings);
    rounds.push_back(r);
    REQUIRE(rounds.size() < 100);
  }
  return rounds;
}

Settings goal_settings() {
  Settings s;
  s.round_steps = 50;
  s.validation_views = 3;
  return s;
}

}  // namespace

TEST_CASE("triangles and levels with the least importance per byte are removed first", "[simplify]") {
  const auto table = table_of({{2, 4}, {2, 4}, {2, 2}, {0, 0}, {2, 4}});
  Importance importance;
  importance.triangle = {9.0, 8.0, 0.001, 0.5, 7.0};
  importance.finest = {0.01, 6.0, 0.9, 0.0, 5.0};
  const std::vector<bool> none(5);
  // The third triangle (15 samples) has almost no importance. Next is the finest level of the first triangle: 108 of
  // 480 samples.
  Pruned a = least_important_removed(importance, table, none, {0.96, 1});
  CHECK(a.kept == std::vector<std::uint32_t>{0, 1, 3, 4});
  CHECK(a.levels == std::vector<soup::TextureLevels>{{2, 4}, {2, 4}, {0, 0}, {2, 4}});
  Pruned b = least_important_removed(importance, table, none, {0.75, 1});
  CHECK(b.kept == std::vector<std::uint32_t>{0, 1, 3, 4});
  CHECK(b.levels == std::vector<soup::TextureLevels>{{2, 3}, {2, 4}, {0, 0}, {2, 4}});
  // Triangles of the backdrop are kept, but their textures may become coarser.
  Pruned c = least_important_removed(importance, table, {false, false, true, true, false}, {0.96, 1});
  CHECK(c.kept.size() == 5);
  CHECK(c.levels[0].level_max == 3);
  // A share of the triangles removes only whole triangles.
  Pruned d = least_important_removed(importance, table, none, {1, 0.6});
  CHECK(d.kept == std::vector<std::uint32_t>{0, 1, 4});
  CHECK(d.levels == std::vector<soup::TextureLevels>(3, {2, 4}));
  // At least one triangle is kept.
  CHECK(least_important_removed(importance, table, none, {0, 1}).kept.size() >= 1);
  CHECK(least_important_removed(importance, table, none, {1, 0}).kept == std::vector<std::uint32_t>{0});
  // A triangle with negative importance, which makes images worse, is removed first.
  importance.triangle[4] = -3;
  CHECK(least_important_removed(importance, table, none, {0.99, 1}).kept == std::vector<std::uint32_t>{0, 1, 2, 3});
}

TEST_CASE("pruning to the knee keeps what gains enough for twice the samples", "[simplify]") {
  // Two triangles of one level have 18 samples, vertices included. The first one, with 9 samples, gains
  // 0.01 / 9 * 18 * 10 log10(2) = 0.0602 dB per doubling, for an error of 1.
  Importance importance{1, {5, 5}, {0.01, 0.9}, {0, 0}, {}};
  const auto two = table_of({{0, 0}, {0, 0}});
  const std::vector<bool> none(2);
  CHECK(pruned_to_knee(importance, two, none, 0.059).kept.size() == 2);
  CHECK(pruned_to_knee(importance, two, none, 0.061).kept == std::vector<std::uint32_t>{1});
  CHECK(pruned_to_knee(importance, two, none, 10).kept.size() == 1);
  // Triangles that no view shows and triangles of the backdrop are kept.
  importance.pixels[0] = 0;
  CHECK(pruned_to_knee(importance, two, none, 0.061).kept.size() == 2);
  importance.pixels[0] = 5;
  CHECK(pruned_to_knee(importance, two, {true, false}, 0.061).kept.size() == 2);
  // Each removal is measured against the error and the samples that remain after the earlier ones. The second triangle
  // is removed only after the first.
  Importance three{1, {5, 5, 5}, {0.001, 0.02, 5}, {0, 0, 0}, {}};
  const auto table = table_of({{0, 0}, {0, 0}, {0, 0}});
  CHECK(pruned_to_knee(three, table, std::vector<bool>(3), 0.13).kept == std::vector<std::uint32_t>{2});
  three.triangle[0] = 0.1;
  CHECK(pruned_to_knee(three, table, std::vector<bool>(3), 0.13).kept == std::vector<std::uint32_t>{0, 1, 2});
  // A finest level can be removed without its triangle.
  const Importance levels{1, {5}, {3}, {1e-6}, {}};
  CHECK(pruned_to_knee(levels, table_of({{2, 4}}), {false}, 0.1).levels == std::vector<soup::TextureLevels>{{2, 3}});
}

TEST_CASE("one of several triangles that can replace each other is kept", "[simplify]") {
  // Triangles 0 and 1 are layers of one colour: either can be removed, but not both. Triangle 2 can be replaced by
  // triangle 1; triangle 3 needs no replacement.
  Importance importance{1, {5, 5, 5, 5}, {0, 0, 1e-9, 0}, {0, 0, 0, 0}, {{0, 1}, {1, 0}, {2, 1}}};
  const auto table = table_of({{0, 0}, {0, 0}, {0, 0}, {0, 0}});
  const std::vector<bool> none(4);
  CHECK(pruned_to_knee(importance, table, none, 0.2).kept == std::vector<std::uint32_t>{1});
  // If triangle 1 is removed first because it costs less, triangles 0 and 2 are kept.
  importance.triangle = {1e-9, 0, 1e-9, 5};
  CHECK(pruned_to_knee(importance, table, none, 0.2).kept == std::vector<std::uint32_t>{0, 2, 3});
  importance.behind.clear();
  CHECK(pruned_to_knee(importance, table, none, 0.2).kept == std::vector<std::uint32_t>{3});
}

TEST_CASE("rounds end just above a target quality", "[simplify]") {
  for (const double target : {20.0, 24.0, 26.5, 27.9}) {
    CAPTURE(target);
    Settings s = goal_settings();
    s.target_psnr = target;
    const auto rounds = simulate(s, 28.0);
    const Round& best = rounds[best_round(rounds, s)];
    CHECK(meets(best, s));
    CHECK(best.psnr - target < 0.2);
    CHECK(outcome(rounds, s).starts_with("goal met"));
    for (const Round& r : rounds)
      if (meets(r, s)) CHECK(best.bytes <= r.bytes);
  }
  Settings s = goal_settings();
  s.target_ssim = 0.89;
  const auto rounds = simulate(s, 28.0);
  const Round& best = rounds[best_round(rounds, s)];
  CHECK(best.ssim >= 0.89);
  CHECK(best.ssim < 0.895);
}

TEST_CASE("a round that removed too much is undone", "[simplify]") {
  // The quality drops suddenly, so earlier halvings do not predict the next one.
  for (const double target : {22.0, 24.0, 25.5, 27.5}) {
    CAPTURE(target);
    Settings s = goal_settings();
    s.target_psnr = target;
    const auto rounds = simulate(s, 28.0, 5);
    const Round& best = rounds[best_round(rounds, s)];
    CHECK(meets(best, s));
    CHECK(best.psnr - target < 0.2);
    CHECK(rounds.size() <= 10);
    std::size_t returns = 0;
    for (std::size_t i = 1; i < rounds.size(); ++i) returns += rounds[i].from != i - 1;
    CHECK(returns > 0);
  }
}

TEST_CASE("a round that nearly reaches a quality is trained further, once", "[simplify]") {
  Settings s = goal_settings();
  s.target_psnr = 25;
  std::vector<Round> rounds{{1000, 1000, 100, 26.0, 0.9, 0, false}, {1050, 600, 60, 24.9, 0.9, 0, true}};
  CHECK(next_round(rounds, s) == NextRound{1, {}});
  rounds.push_back({1100, 601, 60, 24.95, 0.9, 1, false});
  const auto next = next_round(rounds, s);
  REQUIRE(next);
  CHECK(next->from == 0);
  // Interpolates linearly in the logarithm of the bytes between the best round and the one that missed.
  CHECK(next->shares.bytes == Approx(std::pow(0.601, 1 / 1.05)));
  // If the second attempt met the quality, rounds continue from it although it has slightly more bytes.
  std::vector<Round> met = rounds;
  met.back().psnr = 25.06;
  const auto on = next_round(met, s);
  REQUIRE(on);
  CHECK(on->from == 2);
  CHECK(on->shares.bytes < 0.98);
  // Rounds end if there is little to gain.
  rounds.push_back({1150, 618, 62, 25.2, 0.9, 0, true});
  CHECK_FALSE(next_round(rounds, s));
}

TEST_CASE("a smaller model is tried if a quality is just met, and trained further while that gains enough",
          "[simplify]") {
  Settings s = goal_settings();
  s.target_psnr = 25;
  std::vector<Round> rounds{{1000, 1000, 100, 25.02, 0.9, 0, false}};
  CHECK(next_round(rounds, s) == NextRound{0, {0.85, 1}});
  rounds.push_back({1050, 850, 90, 24.8, 0.9, 0, true});
  CHECK(next_round(rounds, s) == NextRound{1, {}});
  rounds.push_back({1100, 849, 90, 24.9, 0.9, 1, false});
  auto enough = rounds;
  enough.back().psnr = 24.92;
  CHECK(next_round(enough, s) == NextRound{2, {}});
  enough.push_back({1150, 851, 90, 25.01, 0.9, 2, false});
  CHECK(next_round(enough, s) == NextRound{3, {0.85, 1}});  // earlier attempts do not count as misses
  // A gain that is too small ends the search: no size in between is worth a round.
  CHECK_FALSE(next_round(rounds, s));
  CHECK(best_round(rounds, s) == 0);
}

TEST_CASE("a size limit is met with the best quality below it", "[simplify]") {
  Settings s = goal_settings();
  s.max_bytes = 1'000'000;
  auto rounds = simulate(s, 28.0);
  CHECK(rounds[best_round(rounds, s)].bytes <= s.max_bytes);
  CHECK(rounds[best_round(rounds, s)].bytes > s.max_bytes / 2);
  s = goal_settings();
  s.max_triangles = 700;
  rounds = simulate(s, 28.0);
  CHECK(rounds[best_round(rounds, s)].triangles <= 700);
  // With a limit and a quality, the limit has priority, and the message says that the quality was missed.
  s.target_psnr = 27.9;
  rounds = simulate(s, 28.0);
  CHECK(rounds[best_round(rounds, s)].triangles <= 700);
  CHECK_THAT(outcome(rounds, s),
             Catch::StartsWith("goal missed") && Catch::Contains("a larger `max_bytes` or `max_triangles`"));
  // Nothing more can be removed, or no rounds remain.
  s.max_triangles = 1;
  CHECK_THAT(outcome(rounds, s), Catch::StartsWith("goal missed") && Catch::Contains("nothing more can be removed"));
  rounds.resize(30, rounds.back());
  CHECK_THAT(outcome(rounds, s), Catch::Contains("no more rounds"));
}

TEST_CASE("takes_away is true if a triangle or a level is removed", "[simplify]") {
  const std::vector<soup::TextureEntry> table = soup::make_texture_table(3, {1, 3}).entries;
  CHECK_FALSE(takes_away({{0, 1, 2}, {{1, 3}, {1, 3}, {1, 3}}}, table));
  CHECK(takes_away({{0, 1, 2}, {{1, 3}, {1, 2}, {1, 3}}}, table));
  CHECK(takes_away({{0, 2}, {{1, 3}, {1, 3}}}, table));
}

TEST_CASE("if training misses a quality, the message says so and the best model is kept", "[simplify]") {
  Settings s = goal_settings();
  s.target_psnr = 30;
  const auto rounds = simulate(s, 28.0);
  CHECK(rounds.size() == 1);
  CHECK(best_round(rounds, s) == 0);
  CHECK(outcome(rounds, s).find("more `steps`") != std::string::npos);
}

TEST_CASE("rounds survive writing and reading as JSON", "[simplify]") {
  Settings s = goal_settings();
  s.target_psnr = 26.5;
  const auto rounds = simulate(s, 28.0);
  const auto again = rounds_from_json(to_json(rounds));
  REQUIRE(again.size() == rounds.size());
  CHECK(to_json(again) == to_json(rounds));
  CHECK(next_round(again, s) == next_round(rounds, s));
  for (std::size_t i = 1; i < rounds.size(); ++i)
    CHECK(next_round(std::span(again).first(i), s) == next_round(std::span(rounds).first(i), s));
  auto damaged = to_json(rounds);
  damaged[1]["from"] = 1;
  CHECK_THROWS_AS(rounds_from_json(damaged), Error);
  damaged[1].erase("from");
  CHECK_THROWS_AS(rounds_from_json(damaged), Error);
  CHECK_THROWS_AS(rounds_from_json(nlohmann::json::parse(R"([{"step": 1}])")), Error);
}

TEST_CASE("learning rates rise at the start of a round and fall to their final values", "[simplify][settings]") {
  Settings s = goal_settings();
  s.steps = 1000;
  s.init = "surface";
  const double end = lr_factor(s, 0.1, 1000);
  CHECK(end == Approx(0.1));
  for (const std::uint64_t round : {0, 1, 5}) {
    double last = 1;
    for (std::uint64_t i = 1; i <= s.round_steps; ++i) {
      const double factor = lr_factor(s, 0.1, 1000 + round * s.round_steps + i);
      CHECK(factor < last);
      last = factor;
      if (i == 1) CHECK(factor > 1.5 * end);
    }
    CHECK(last == Approx(end));
    // The learning rate of vertices falls close to zero, depending on the steps of a round.
    CHECK(vertex_lr_factor(s, 1000 + (round + 1) * s.round_steps) <
          0.02 * vertex_lr_factor(s, 1000 + round * s.round_steps + 1));
    CHECK(vertex_lr_factor(s, 1000 + (round + 1) * s.round_steps) > 0);
  }
}

TEST_CASE("validation views are spread over the training views and removed from the views of points", "[hold_out]") {
  scene::Scene scene;
  scene.path = "somewhere";
  for (int i = 0; i < 20; ++i) scene.train.push_back({std::to_string(i), {}, {}});
  scene.points.seen_by = {{0, 2, 3, 19}, {2, 7}, {}};
  scene::hold_out(scene, 4);
  std::vector<std::string> held;
  for (const scene::View& v : scene.validation) held.push_back(v.name);
  CHECK(held == std::vector<std::string>{"2", "7", "12", "17"});
  REQUIRE(scene.train.size() == 16);
  CHECK(scene.train[2].name == "3");
  CHECK(scene.points.seen_by == std::vector<std::vector<std::uint32_t>>{{0, 2, 15}, {}, {}});
  CHECK_THROWS_WITH(scene::hold_out(scene, 8), Catch::Contains("somewhere") && Catch::Contains("`validation_views`"));
  CHECK(scene.train.size() == 16);
  CHECK(scene::usual_validation_views(scene) == 3);
}
