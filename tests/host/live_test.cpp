#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include <catch2/catch.hpp>

#include "viewer/live.h"

using namespace trisoup;
using namespace std::chrono_literals;

namespace {

struct ServedTraining {
  std::atomic<bool> stop{false};
  viewer::Live live{stop};
  int models = 0;
  std::uint64_t step = 0;

  /// Trains with steps of 1 ms for `time` or until `enough` models were published.
  void train(std::chrono::milliseconds time, int enough = 1 << 30) {
    live.report({step, 0.1, 20}, 100, 1.0);
    for (const auto end = std::chrono::steady_clock::now() + time;
         std::chrono::steady_clock::now() < end && models < enough;) {
      const std::uint64_t until = live.until(step, {[&] {
                                                      ++models;
                                                      return soup::Model();
                                                    },
                                                    {}});
      if (until <= step) throw std::logic_error("no step to make");
      std::this_thread::sleep_for(std::min<std::uint64_t>(until - step, 100) * 1ms);
      step = until;
    }
  }
};

constexpr auto kPatience = 10s;  // time limit on a busy machine

}  // namespace

TEST_CASE("live: the next model is published after the window has shown the last one", "[live]") {
  ServedTraining t;
  t.train(250ms);
  REQUIRE(t.models == 1);
  REQUIRE(t.live.take_model());
  t.train(150ms);
  REQUIRE(t.models == 1);
  t.live.shown(0);
  t.train(kPatience, 2);
  REQUIRE(t.models == 2);
}

TEST_CASE("live: a fast window receives at most ten models per second", "[live]") {
  ServedTraining t;
  const auto start = std::chrono::steady_clock::now();
  {
    std::jthread window([&](std::stop_token stop) {
      while (!stop.stop_requested()) {
        if (t.live.take_model()) t.live.shown(0);
        std::this_thread::sleep_for(1ms);
      }
    });
    t.train(kPatience, 6);
  }
  REQUIRE(t.models == 6);
  REQUIRE(std::chrono::steady_clock::now() - start >= 500ms);
}

TEST_CASE("live: time on a shared device lowers the rate of models", "[live]") {
  ServedTraining t;
  const auto start = std::chrono::steady_clock::now();
  t.train(kPatience, 1);
  REQUIRE(t.live.take_model());
  t.live.shown(0.05);  // 5 % of 1 s
  t.train(kPatience, 2);
  REQUIRE(t.models == 2);
  REQUIRE(std::chrono::steady_clock::now() - start >= 990ms);
}

TEST_CASE("live: a window that has not taken the model gets no new one", "[live]") {
  ServedTraining t;
  t.train(10ms);
  t.live.shown(0);  // only panels were drawn; the model was not taken
  t.train(250ms);
  REQUIRE(t.models == 1);
}

TEST_CASE("live: pause, single steps, and training on after the window is closed", "[live]") {
  ServedTraining t;
  const auto model = [] { return soup::Model(); };
  t.live.pause(true);
  t.live.step_once();
  REQUIRE(t.live.until(5, {model, {}}) == 6);
  std::atomic<bool> returned{false};
  std::jthread training([&] {
    t.live.until(6, {model, {}});
    returned = true;
  });
  std::this_thread::sleep_for(150ms);
  REQUIRE_FALSE(returned);
  t.live.close();
  training.join();
  REQUIRE(t.live.until(7, {model, {}}) == ~std::uint64_t(0));
}

TEST_CASE("live: models are made for a page only while somebody looks, and seldom", "[live]") {
  std::atomic<bool> stop{false};
  viewer::Live live(stop, viewer::Live::Window::no);
  int models = 0;
  const viewer::Live::Tasks tasks{[&] {
                                    ++models;
                                    return soup::Model();
                                  },
                                  {}};
  live.report({0, 0.1, 20}, 100, 1.0);
  REQUIRE(live.until(5, tasks) == ~std::uint64_t(0));
  REQUIRE(models == 0);
  live.look();
  REQUIRE(live.looked_at());
  REQUIRE(live.until(6, tasks) > 6);
  REQUIRE(models == 1);
  const std::stop_source nobody;
  REQUIRE(live.wait_for_model(nobody.get_token()));
  REQUIRE_FALSE(live.all_sent());
  live.sent(0);
  REQUIRE(live.all_sent());
  live.until(7, tasks);
  REQUIRE(models == 1);  // the next one is due in some seconds
  live.pause(true);
  std::jthread training([&] { live.until(8, tasks); });
  REQUIRE(live.wait_for_model(nobody.get_token()));  // what a pause shows
  live.pause(false);
}

TEST_CASE("live: a training that is paused saves when it is asked to", "[live]") {
  std::atomic<bool> stop{false};
  viewer::Live live(stop, viewer::Live::Window::no);
  live.pause(true);
  std::jthread training([&] { live.until(3, {[] { return soup::Model(); }, [] { return std::string("saved"); }}); });
  live.save();
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (live.state().message.empty() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(1ms);
  CHECK(live.state().message == "saved");
  stop = true;  // ends a pause
}
