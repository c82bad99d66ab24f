// Tests RendererComparison of engine/train/quality/evaluate_renderer.h.
#include <catch2/catch.hpp>

#include <limits>

#include "train/quality/evaluate_renderer.h"

using trisoup::train::RendererComparison;

TEST_CASE("the renderer may differ from training in a small share of pixels, also in small images", "[agreement]") {
  CHECK(RendererComparison{"", 625, 0, 100}.passes());
  CHECK(RendererComparison{"", 625, 1, 100}.passes());
  CHECK(RendererComparison{"", 625, 3, 100}.passes());
  CHECK_FALSE(RendererComparison{"", 625, 4, 100}.passes());
  CHECK(RendererComparison{"", 1'000'000, 1000, 100}.passes());
  CHECK_FALSE(RendererComparison{"", 1'000'000, 1001, 100}.passes());
  CHECK_FALSE(RendererComparison{"", 625, 0, 60}.passes());
  CHECK_FALSE(RendererComparison{"", 625, 0, std::numeric_limits<double>::quiet_NaN()}.passes());
}
