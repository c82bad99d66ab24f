// Tests engine/train/settings.h: when a run is evaluated.
#include <catch2/catch.hpp>

#include <vector>

#include "train/settings.h"

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
