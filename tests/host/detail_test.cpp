#include <catch2/catch.hpp>

#include "viewer/detail.h"

using namespace trisoup::viewer;
using namespace std::chrono_literals;
using Clock = Rest::Clock;

TEST_CASE("a rendering respects its limit of pixels and uses most of it", "[detail]") {
  CHECK(pixel_side(1280, 800, kSharedRestPixels) == 1);
  CHECK(pixel_side(1280, 800, kMotionPixels) == 4);
  CHECK(pixel_side(1280, 800, kSharedMotionPixels) == 6);
  CHECK(pixel_side(1920, 1080, kSharedRestPixels) == 2);
  CHECK(pixel_side(100, 100, 10'000) == 1);
  CHECK(pixel_side(101, 100, 10'000) == 2);
  CHECK(pixel_side(1, 1, 10'000) == 1);
  // An eighth of the resolution is the minimum.
  CHECK(pixel_side(7680, 4320, kSharedMotionPixels) == 8);
}

TEST_CASE("a camera is at rest shortly after its last movement", "[detail]") {
  Rest rest;
  const Clock::time_point now = Clock::time_point{} + 1h;
  CHECK(rest.due(now));
  rest.moved(now);
  CHECK(rest.moving(now));
  CHECK(!rest.due(now));
  CHECK(!rest.due(now + Rest::kStill - 1ms));
  CHECK(rest.due(now + Rest::kStill));
}

TEST_CASE("a camera that stops repeatedly is drawn at rest once per interval", "[detail]") {
  Rest rest;
  Clock::time_point now = Clock::time_point{} + 1h;
  int drawn = 0;
  for (int ms = 0; ms < 10'000; ms += 10, now += 10ms) {
    if (ms % 300 == 0) rest.moved(now);
    if (!rest.due(now)) continue;
    rest.take(now, 0ms);
    ++drawn;
  }
  CHECK(drawn <= 10);
  CHECK(drawn >= 8);
}

TEST_CASE("a moving camera is not drawn at rest, but soon after it stops", "[detail]") {
  Rest rest;
  Clock::time_point now = Clock::time_point{} + 1h;
  for (int i = 0; i < 100; ++i, now += 100ms) {
    rest.moved(now);
    CHECK(!rest.due(now + 100ms));
  }
  CHECK(rest.due(now + Rest::kStill));
}

TEST_CASE("the first frames at rest follow each other quickly", "[detail]") {
  Rest rest(2);
  const Clock::time_point now = Clock::time_point{} + 1h;
  for (int i = 0; i < 2; ++i) {
    rest.take(now, 2s);
    CHECK(rest.next() == now + Rest::kEarly);
  }
  rest.take(now, 2s);
  CHECK(rest.next() > now + 30s);
}

TEST_CASE("frames at rest take at most their share of the CPU", "[detail]") {
  Rest rest;
  const Clock::time_point now = Clock::time_point{} + 1h;
  rest.take(now, 20ms);
  CHECK(rest.next() == now + 1s);
  rest.take(now, 200ms);
  CHECK(std::chrono::abs(rest.next() - now - 10s) < 1ms);
}
