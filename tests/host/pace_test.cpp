#include <algorithm>

#include <catch2/catch.hpp>

#include "viewer/pace.h"

using namespace trisoup::viewer;
using namespace std::chrono_literals;
using Clock = Pace::Clock;

namespace {

/// Returns the time for `pictures` frames that each come late by `late`.
Clock::duration waited(Pace& pace, Clock::time_point& now, int pictures, Clock::duration late) {
  const Clock::time_point start = now;
  for (int i = 0; i < pictures; ++i) {
    now = std::max(now, pace.due()) + late;
    pace.take(now);
  }
  return now - start;
}

}  // namespace

TEST_CASE("slightly late frames do not lower the rate", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  pace.take(now);
  CHECK(waited(pace, now, 100, 30ms) == 10s + 30ms);
}

TEST_CASE("frames before they are due do not delay later ones", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  for (int i = 0; i < 500; ++i) pace.take(now += 10ms);
  CHECK(pace.due() - now <= 100ms);
  CHECK(waited(pace, now, 10, 0ms) <= 1s);
  CHECK(waited(pace, now, 10, 0ms) == 1s);
}

TEST_CASE("a delay of more than an interval is not made up for", "[pace]") {
  Pace pace(100ms);
  Clock::time_point now = Clock::time_point{} + 1h;
  pace.take(now);
  now += 10s;
  pace.take(now);
  CHECK(pace.due() == now + 100ms);
  // A machine that cannot keep up does not get faster frames afterwards.
  CHECK(waited(pace, now, 10, 250ms) == 10 * 350ms);
  CHECK(waited(pace, now, 10, 0ms) == 1s);
}
