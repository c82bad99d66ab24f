// Tests engine/train/config/settings.h: when a run is evaluated, and how far its vertices travel.
#include <catch2/catch.hpp>

#include <vector>

#include "recipe_settings.h"
#include "train/config/schedule.h"
#include "train/config/settings.h"

using namespace trisoup;

TEST_CASE("evaluations lie evenly over the logarithm of the steps", "[settings]") {
  CHECK(train::next_evaluation(0, 17) == 0);
  std::vector<std::uint64_t> steps;
  for (std::uint64_t s = 0; s < 1000; steps.push_back(s)) s = train::next_evaluation(4, s);
  CHECK(steps == std::vector<std::uint64_t>{10, 18, 32, 56, 100, 178, 316, 562, 1000});
  // Many to a decade: steps that round to the same one are one, and from any step on the next is later.
  for (std::uint64_t s = 0; s < 300; ++s) CHECK(train::next_evaluation(100, s) > s);
  CHECK(train::next_evaluation(100, 10) == 11);
  CHECK(train::next_evaluation(1, 999'999) == 1'000'000);
}

TEST_CASE("vertices travel equally far in few steps", "[settings]") {
  const auto recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  train::Settings s = test::settings_of_recipe(recipe);
  const auto way = [&] {
    double sum = 0;
    for (std::uint64_t step = 1; step <= s.steps; ++step)
      sum += s.lr_vertex * train::lr_factor(s, s.lr_vertex_end, step);
    return sum;
  };
  CHECK(way() == Approx(train::published_travel(recipe)).epsilon(0.001));
  // What is published stays as it is to the last bit.
  CHECK(train::vertex_lr(s, train::published_travel(recipe)) <= s.lr_vertex);
  for (const double end : {0.01, 0.1, 1.0})
    for (const std::uint64_t steps : {400, 1000, 10'000}) {
      s.lr_vertex_end = end;
      s.steps = steps;
      s.lr_vertex = train::vertex_lr(s, 0.8);
      CHECK(way() == Approx(0.8).epsilon(0.01));
    }
  s.steps = 1;
  CHECK(train::vertex_lr(s, 0.8) == train::kMaxVertexLr);
}

TEST_CASE("vertices come to rest, and travel as far as they are to", "[settings]") {
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.lr_vertex_end = 0.1;
  for (const char* init : {"points", "surface"}) {
    CAPTURE(init);
    s.init = init;
    const bool rests = train::starts_from_surface(s);
    s.lr_vertex = train::vertex_lr(s, 4.0);
    double sum = 0, last = 2;
    for (std::uint64_t step = 1; step <= s.steps; ++step) {
      const double factor = train::vertex_lr_factor(s, step);
      CHECK(factor < last);
      last = factor;
      sum += s.lr_vertex * factor;
    }
    CHECK(sum == Approx(4.0).epsilon(0.001));
    CHECK(last > 0);
    CHECK((last < 0.1 / (0.2 * double(s.steps))) == rests);
    // Until then as without it.
    CHECK(train::vertex_lr_factor(s, 1) == Approx(train::lr_factor(s, 0.1, 1)).epsilon(1e-3));
  }
}

TEST_CASE("the weight of the depth loss falls to 0 and stays there", "[settings]") {
  train::Settings s;
  s.steps = 100;
  s.lambda_depth = 2;
  s.depth_until = 0.5;
  CHECK(train::depth_weight(s, 1) == 2);
  CHECK(train::depth_weight(s, 26) == Approx(1));
  CHECK(train::depth_weight(s, 51) == 0);
  CHECK(train::depth_weight(s, 130) == 0);  // of a round after the last step
  s.depth_until = 0;
  CHECK(train::depth_weight(s, 1) == 0);
}

TEST_CASE("a soup is brought to its knee after the last change by the budget, and not without one", "[settings]") {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.steps = 1000;
  CHECK(train::next_pruning(s, 0) == 0);
  CHECK(train::is_last_refinement(s, 900));
  s.knee = 0.2;
  CHECK(train::next_pruning(s, 0) == 700);
  CHECK(train::next_pruning(s, 699) == 700);
  CHECK(train::next_pruning(s, 700) == 800);
  CHECK(train::next_pruning(s, 899) == 900);
  CHECK(train::next_pruning(s, 900) == 0);
  CHECK(train::is_last_refinement(s, 600));
  s.coarse_share = 0.8;
  CHECK(train::next_pruning(s, 0) == 900);  // not before the fine levels, nor with them
  s.coarse_share = 0.5;
  CHECK_FALSE(train::is_refinement(s, 700));
  for (s.steps = 1; s.steps < 30; ++s.steps)
    for (std::uint64_t step = 0; step < s.steps; ++step) {
      const std::uint64_t next = train::next_pruning(s, step);
      CHECK((next == 0 || (next > step && next < s.steps)));
    }
}

TEST_CASE("a start beyond its budget has a change of topology however short the training", "[settings]") {
  train::Settings s = test::settings_of_recipe(train::Recipe::synthetic);
  s.init_count = 30'000;
  s.triangles = 300;
  const auto changes = [&] {
    std::vector<std::uint64_t> steps;
    for (std::uint64_t step = 0; step <= s.steps; ++step)
      if (train::is_refinement(s, step)) steps.push_back(step);
    return steps;
  };
  const auto last = [&] {
    for (const std::uint64_t step : changes())
      if (train::is_last_refinement(s, step)) return step;
    return std::uint64_t{0};
  };
  s.steps = 90;
  CHECK(changes() == std::vector<std::uint64_t>{42});
  CHECK(last() == 42);
  s.refine_until = 0.5;
  s.steps = 199;
  CHECK(changes() == std::vector<std::uint64_t>{49});
  s.steps = 200;
  CHECK(changes() == std::vector<std::uint64_t>{100});
  // The last step of all has nothing behind it.
  s.refine_until = 1;
  s.steps = 300;
  CHECK(changes() == std::vector<std::uint64_t>{100, 200});
  CHECK(last() == 200);
  s.steps = 100;
  CHECK(changes() == std::vector<std::uint64_t>{50});
  // Where there is no need, or none is asked for.
  s.init_count = 300;
  CHECK(changes().empty());
  s.init_count = 30'000;
  s.refine_every = 0;
  CHECK(changes().empty());
  s.refine_every = 100;
  s.steps = 1;
  CHECK(changes().empty());
}

TEST_CASE("poses are corrected about once per epoch, and not in the last fifth of the steps", "[settings][poses]") {
  train::Settings s = test::settings_of_recipe(train::Recipe::real);
  s.steps = 100;
  s.coarse_share = 0;
  s.pose_every = 30;
  const auto corrections = [&] {
    std::vector<std::uint64_t> steps;
    for (std::uint64_t step = 0; step <= s.steps; ++step)
      if (train::is_pose_correction(s, step)) steps.push_back(step);
    return steps;
  };
  CHECK(corrections().empty());
  s.pose_corrections = true;
  CHECK(corrections() == std::vector<std::uint64_t>{30, 60});
  s.pose_every = 40;
  CHECK(corrections() == std::vector<std::uint64_t>{40, 80});
  // The first half of a start that covers nothing shows too little.
  s.coarse_share = 0.5;
  s.pose_every = 10;
  CHECK(corrections() == std::vector<std::uint64_t>{60, 70, 80});
  s.refine_every = s.checkpoint_every = 0;
  CHECK(train::next_event(s, {}, 0, 100) == 50);
  CHECK(train::next_event(s, {}, 50, 100) == 60);
  CHECK(train::next_event(s, {}, 71, 100) == 80);
  CHECK(train::next_event(s, {}, 80, 100) == 100);
  s.pose_every = 0;
  CHECK(corrections().empty());
}
