// Tests engine/base/cancellation.h.
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <thread>

#include "base/cancellation.h"
#include "base/parallel_for.h"

using namespace trisoup;

TEST_CASE("work without a scope, or in another thread, is not cancelled", "[cancellation]") {
  check_cancellation();
  const CancellationScope scope([] { return true; });
  std::thread([] { check_cancellation(); }).join();
  CHECK_THROWS_AS(check_cancellation(), Cancelled);
}

TEST_CASE("the innermost scope is asked", "[cancellation]") {
  const CancellationScope outer([] { return true; });
  {
    const CancellationScope inner({});
    check_cancellation();
  }
  CHECK_THROWS_AS(check_cancellation(), Cancelled);
}

TEST_CASE("a poll asks at most twenty times a second, and not after yes", "[cancellation]") {
  using Clock = std::chrono::steady_clock;
  int questions = 0;
  CancellationPoll poll([&] { return ++questions == 3; });
  const auto start = Clock::now();
  while (!poll.ask()) {
  }
  CHECK(Clock::now() - start >= std::chrono::milliseconds(100));
  for (int i = 0; i < 1000; ++i) CHECK(poll.ask());
  CHECK(questions == 3);
}

TEST_CASE("a parallel loop ends when it is cancelled", "[cancellation]") {
  const int threads = GENERATE(1, 4);
  std::atomic<bool> wanted = true;
  std::atomic<int> calls = 0;
  const CancellationScope scope([&] { return !wanted; });
  const auto loop = [&] {
    parallel_for(1'000'000, threads, [&](int) {
      if (++calls == 3) wanted = false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
  };
  CHECK_THROWS_AS(loop(), Cancelled);
  CHECK(calls < 10'000);
}
