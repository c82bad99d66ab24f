#include "ranks_of_threads.h"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cstring>
#include <numeric>
#include <random>
#include <thread>

namespace trisoup::test {
namespace {

/// Where messages lie until they are taken.
struct Board {
  explicit Board(int ranks) : met(ranks), messages(static_cast<std::size_t>(ranks)) {}
  std::barrier<> met;
  std::vector<std::vector<ranks::ByteView>> messages;  // [from][to]
};

class ThreadRank : public ranks::Ranks {
 public:
  ThreadRank(Board& board, int rank, int size, std::uint64_t seed)
      : Ranks(rank, size, "threads"), board_(board), random_(seed + static_cast<std::uint64_t>(rank)) {}

 protected:
  void send_numbers(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) override {
    std::vector<ranks::ByteView> out;
    std::vector<std::span<std::byte>> in;
    for (const std::uint64_t& n : to) out.push_back(std::as_bytes(std::span(&n, 1)));
    for (std::uint64_t& n : from) in.push_back(std::as_writable_bytes(std::span(&n, 1)));
    send_bytes(out, in);
  }
  void send_bytes(std::span<const ranks::ByteView> to, std::span<const std::span<std::byte>> from) override {
    delay();
    board_.messages[static_cast<std::size_t>(rank())].assign(to.begin(), to.end());
    board_.met.arrive_and_wait();
    std::vector<std::size_t> order(from.size());
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), random_);
    for (const std::size_t r : order) {
      delay();
      const ranks::ByteView message = board_.messages[r][static_cast<std::size_t>(rank())];
      if (message.size() != from[r].size())
        throw Error("rank {}: rank {} has sent {} bytes, not {}", rank(), r, message.size(), from[r].size());
      std::copy(message.begin(), message.end(), from[r].begin());
    }
    board_.met.arrive_and_wait();
  }

 private:
  void delay() {
    if (const auto length = random_() % 4; length > 0)
      std::this_thread::sleep_for(std::chrono::microseconds(20 * length));
  }
  Board& board_;
  std::mt19937_64 random_;
};

}  // namespace

std::vector<std::string> run_as_ranks(int size, const std::function<void(ranks::Ranks&)>& body, std::uint64_t seed) {
  Board board(size);
  std::vector<std::string> thrown(static_cast<std::size_t>(size));
  std::vector<std::jthread> threads;
  for (int r = 0; r < size; ++r)
    threads.emplace_back([&, r] {
      ThreadRank rank(board, r, size, seed);
      try {
        body(rank);
      } catch (const std::exception& e) {
        thrown[static_cast<std::size_t>(r)] = e.what();
        rank.leave(e.what());
      }
      // Who leaves takes part in an exchange that others are waiting in; a rank that is done waits for none.
      board.met.arrive_and_drop();
    });
  threads.clear();
  return thrown;
}

}  // namespace trisoup::test
