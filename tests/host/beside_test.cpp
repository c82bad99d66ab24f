// Tests viewer/beside.h.
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <future>
#include <string>

#include "base/error.h"
#include "viewer/beside.h"

using namespace trisoup;
using namespace std::chrono_literals;

TEST_CASE("background work reports progress while other threads continue", "[beside]") {
  viewer::Beside beside;
  CHECK_FALSE(beside.busy());
  std::promise<void> compiled, told;
  beside.begin([&](const viewer::Beside::Say& say) {
    say("first");
    say("second");
    told.set_value();
    compiled.get_future().wait();  // as with a slow compiler
  });
  told.get_future().wait();
  CHECK(beside.busy());
  CHECK_FALSE(beside.done_within(20ms));
  CHECK(beside.news() == "second");
  CHECK(beside.news() == std::nullopt);
  compiled.set_value();
  CHECK(beside.done_within(10s));
  beside.end();
  CHECK_FALSE(beside.busy());
}

TEST_CASE("end() throws the error of background work, and other work can follow", "[beside]") {
  viewer::Beside beside;
  beside.begin([](const viewer::Beside::Say&) { throw Error("no such shader"); });
  CHECK_THROWS_WITH(beside.end(), "no such shader");
  std::atomic<bool> ran = false;
  beside.begin([&](const viewer::Beside::Say&) { ran = true; });
  beside.end();
  CHECK(ran);
}
