// Tests engine/soup/soup.h.
#include <catch2/catch.hpp>

#include "soup/soup.h"

using namespace trisoup::soup;

TEST_CASE("a lattice of level R has (2^R + 1)(2^R + 2) / 2 samples", "[soup]") {
  for (std::uint32_t level = 0; level <= kMaxLevel; ++level) {
    const std::uint32_t r = 1u << level;
    CHECK(samples_at(level) == (r + 1) * (r + 2) / 2);
  }
  CHECK(samples_in(2, 5) == 774);
  CHECK(Mlp::kParameters == 595);
}
