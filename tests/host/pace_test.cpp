#include <algorithm>

#include <catch2/catch.hpp>

#include "viewer/pace.h"

using namespace trisoup::viewer;
using namespace std::chrono_literals;
using Clock = Pace::Clock;

namespace {

/// Waits for `pictures` of them, each `late`; how long that takes.
Clock::duration waited(Pace& pace, Clock::time_point& now, int pictures, Clock::duration late) {
  const Clock::time_point start = now;
  for (int i = 0; i < pictures; ++i) {
    now = std::max(now, pace.due()) + late;
    pace.take(now);
  }
  return now - start;
}

}  // namespace

TEST_CASE("pictures that come a little late are as many all the same", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  pace.take(now);
  CHECK(waited(pace, now, 100, 30ms) == 10s + 30ms);
}

TEST_CASE("pictures that nobody waited for leave no debt", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  for (int i = 0; i < 500; ++i) pace.take(now += 10ms);
  CHECK(pace.due() - now <= 100ms);
  CHECK(waited(pace, now, 10, 0ms) <= 1s);
  CHECK(waited(pace, now, 10, 0ms) == 1s);
}

TEST_CASE("what is late by more than an interval is not made up for", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  pace.take(now);
  now += 10s;
  pace.take(now);
  CHECK(pace.due() == now + 100ms);
  // A machine that never keeps up gets them one after the other, and no faster afterwards.
  CHECK(waited(pace, now, 10, 250ms) == 10 * 350ms);
  CHECK(waited(pace, now, 10, 0ms) == 1s);
}
