#include "ranks/ranks.h"

#include <unistd.h>

#include <algorithm>
#include <array>

namespace trisoup::ranks {
namespace {

/// Bit in the length of a message that marks the message as the sender's reason for leaving.
constexpr std::uint64_t kLeaves = 1ull << 63;

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
}

std::string text_of(ByteView bytes) {
  const auto* first = reinterpret_cast<const char*>(bytes.data());
  return {first, first + bytes.size()};
}

class Alone : public Ranks {
 public:
  Alone() : Ranks(0, 1, "one process") {}

 protected:
  void send_numbers(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) override { from[0] = to[0]; }
  void send_bytes(std::span<const ByteView> to, std::span<const std::span<std::byte>> from) override {
    std::copy(to[0].begin(), to[0].end(), from[0].begin());
  }
};

}  // namespace

std::vector<Bytes> Ranks::exchange(std::span<const ByteView> to, bool leaving) {
  const auto ranks = static_cast<std::size_t>(size_);
  std::vector<std::uint64_t> lengths(ranks), coming(ranks);
  for (std::size_t r = 0; r < ranks; ++r) {
    lengths[r] = to[r].size() | (leaving ? kLeaves : 0);
    if (r != static_cast<std::size_t>(rank_)) bytes_sent_ += to[r].size() + sizeof(std::uint64_t);
  }
  send_numbers(lengths, coming);
  std::vector<Bytes> received(ranks);
  std::vector<std::span<std::byte>> places;
  for (std::size_t r = 0; r < ranks; ++r) {
    received[r].resize(coming[r] & ~kLeaves);
    places.emplace_back(received[r]);
  }
  send_bytes(to, places);
  if (leaving) return received;
  for (std::size_t r = 0; r < ranks; ++r)
    if (coming[r] & kLeaves) {
      ended_ = true;
      throw RankLost(text_of(received[r]));
    }
  return received;
}

std::vector<Bytes> Ranks::exchange(std::span<const ByteView> to) {
  if (ended_) throw Error("rank {} of {}: communication has ended; no exchange is possible", rank_, size_);
  try {
    return exchange(to, false);
  } catch (...) {
    ended_ = true;
    throw;
  }
}

std::vector<Bytes> Ranks::all_gather(ByteView mine) {
  return exchange(std::vector<ByteView>(static_cast<std::size_t>(size_), mine));
}

Bytes Ranks::broadcast(int rank, ByteView mine) {
  std::vector<Bytes> all = all_gather(rank == rank_ ? mine : ByteView{});
  return std::move(all[static_cast<std::size_t>(rank)]);
}

bool Ranks::leave(std::string_view why) noexcept {
  if (ended_) return true;
  ended_ = true;
  try {
    const std::string text = fmt::format("rank {} of {} ({}): {}", rank_, size_, host_name(), why);
    exchange(std::vector<ByteView>(static_cast<std::size_t>(size_), std::as_bytes(std::span(text))), true);
    return true;
  } catch (...) {
    return false;
  }
}

std::unique_ptr<Ranks> alone() { return std::make_unique<Alone>(); }

}  // namespace trisoup::ranks
