// Tests Agreement of engine/train/quality/evaluate_renderer.h.
#include <catch2/catch.hpp>

#include <limits>

#include "train/quality/evaluate_renderer.h"

using trisoup::train::Agreement;

TEST_CASE("the renderer may differ from training in a small share of pixels, also in small images", "[agreement]") {
  CHECK(Agreement{"", 625, 0, 100}.holds());
  CHECK(Agreement{"", 625, 1, 100}.holds());
  CHECK(Agreement{"", 625, 3, 100}.holds());
  CHECK_FALSE(Agreement{"", 625, 4, 100}.holds());
  CHECK(Agreement{"", 1'000'000, 1000, 100}.holds());
  CHECK_FALSE(Agreement{"", 1'000'000, 1001, 100}.holds());
  CHECK_FALSE(Agreement{"", 625, 0, 60}.holds());
  CHECK_FALSE(Agreement{"", 625, 0, std::numeric_limits<double>::quiet_NaN()}.holds());
}
