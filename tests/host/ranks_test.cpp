// Tests engine/ranks/ranks.h with threads as ranks, and engine/ranks/launched.h.
#include <catch2/catch.hpp>

#include <cstdlib>

#include "base/read_file.h"
#include "ranks/launched.h"
#include "ranks_of_threads.h"

using namespace trisoup;

namespace {

std::string text_of(const ranks::Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace

TEST_CASE("ranks exchange messages of any length in order of rank, whenever they arrive", "[ranks]") {
  constexpr int kRounds = 20;
  std::vector<std::string> wrong(3);
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    const auto self = static_cast<std::size_t>(ranks.rank());
    for (int round = 0; round < kRounds; ++round) {
      std::vector<std::string> to;
      for (int r = 0; r < 3; ++r)
        to.push_back(fmt::format("{} to {}{}", self, r, std::string(static_cast<std::size_t>(round * (r + 1)), '.')));
      to[1].clear();  // an empty message
      const auto received =
          ranks.exchange(std::vector<ranks::ByteView>{bytes_of(to[0]), bytes_of(to[1]), bytes_of(to[2])});
      for (std::size_t r = 0; r < 3; ++r) {
        const std::string expected =
            self == 1
                ? ""
                : fmt::format("{} to {}{}", r, self, std::string(static_cast<std::size_t>(round) * (self + 1), '.'));
        if (text_of(received[r]) != expected) wrong[self] = text_of(received[r]);
      }
    }
    const std::string word = fmt::format("of {}", self);
    if (text_of(ranks.broadcast(2, bytes_of(word))) != "of 2") wrong[self] = "broadcast(2)";
  });
  CHECK(thrown == std::vector<std::string>(3));
  CHECK(wrong == std::vector<std::string>(3));
}

TEST_CASE("a failing rank ends all ranks with a line that names it", "[ranks]") {
  std::vector<int> rounds(3);
  const auto thrown = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    for (int round = 0; round < 10; ++round) {
      if (ranks.rank() == 1 && round == 4) throw Error("photographs: there is no room");
      ranks.all_gather({});
      ++rounds[static_cast<std::size_t>(ranks.rank())];
    }
  });
  CHECK(rounds == std::vector<int>{4, 4, 4});
  CHECK(thrown[1] == "photographs: there is no room");
  for (const int r : {0, 2}) {
    CHECK(thrown[static_cast<std::size_t>(r)].starts_with("rank 1 of 3 ("));
    CHECK(thrown[static_cast<std::size_t>(r)].ends_with("): photographs: there is no room"));
  }
  // Two failures at once do not deadlock.
  const auto both = test::run_as_ranks(3, [&](ranks::Ranks& ranks) {
    if (ranks.rank() > 0) throw Error("gone {}", ranks.rank());
    ranks.all_gather({});
  });
  CHECK(both[0].ends_with("gone 1"));
}

TEST_CASE("a single process is one rank that sends to itself", "[ranks]") {
  const auto alone = ranks::alone();
  CHECK(alone->size() == 1);
  CHECK(alone->is_first());
  const std::string word = "word";
  CHECK(text_of(alone->all_gather(bytes_of(word))[0]) == word);
  CHECK(alone->bytes_sent() == 0);
  CHECK(alone->leave("the end"));
  CHECK_THROWS_AS(alone->all_gather({}), Error);
}

TEST_CASE("a message that is not a list of values is refused", "[ranks]") {
  const std::vector<std::byte> bytes(7);
  CHECK_THROWS_WITH(ranks::values_of<float>(bytes), Catch::Contains("7 bytes"));
  CHECK(ranks::values_of<float>(ranks::ByteView(bytes).first(4)).size() == 1);
}

TEST_CASE("several launched processes without the plugin are an error", "[ranks]") {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS", "PMIX_RANK", "PMI_RANK"})
    ::unsetenv(variable);
  CHECK(ranks::launched_size() == 1);
  CHECK(ranks::open_launched("/nonexistent")->size() == 1);
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    ::setenv(variable, "3", 1);
    CHECK(ranks::launched_size() == 3);
    const bool slurm = std::string(variable) == "SLURM_STEP_NUM_TASKS";
    CHECK_THROWS_WITH(ranks::open_launched("/nonexistent"),
                      Catch::Contains("3 processes") && Catch::Contains(slurm ? "--mpi=pmix" : "libopenmpi-dev"));
    ::setenv(variable, "1", 1);
    CHECK(ranks::open_launched("/nonexistent")->size() == 1);
    ::unsetenv(variable);
  }
}
