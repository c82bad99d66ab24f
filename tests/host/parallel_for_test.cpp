// Tests engine/base/parallel_for.h.
#include <catch2/catch.hpp>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "base/parallel_for.h"

using trisoup::parallel_for;

TEST_CASE("parallel_for calls every index once", "[scene][parallel]") {
  const int threads = GENERATE(0, 1, 4, 50);
  std::vector<std::atomic<int>> calls(31);
  parallel_for(31, threads, [&](int i) { ++calls[std::size_t(i)]; });
  for (const auto& count : calls) CHECK(count == 1);
  parallel_for(0, threads, [](int) { throw std::logic_error("never"); });
}

TEST_CASE("parallel_for reports the first failure, whichever thread is faster", "[scene][parallel]") {
  for (int round = 0; round < 50; ++round) {
    std::string message;
    try {
      parallel_for(20, 4, [](int i) {
        if (i >= 3) throw std::runtime_error(std::to_string(i));
      });
    } catch (const std::runtime_error& error) {
      message = error.what();
    }
    CHECK(message == "3");
  }
}
