// Communication between processes (ranks) that train one soup together, usually on several machines. Implementations
// transfer the bytes through MPI (launched.h) or, in tests, between threads of one process. Kernels do not depend on
// ranks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/error.h"

namespace trisoup::ranks {

using Bytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

/// Thrown on all other ranks when one rank fails. The message names that rank: "rank 2 of 4 (node17): REASON".
class RankLost : public Error {
 public:
  explicit RankLost(const std::string& message) : Error("{}", message) {}
};

/// Collective communication. All ranks must make the same calls in the same order, and each call waits for the other
/// ranks. Not thread-safe.
class Ranks {
 public:
  virtual ~Ranks() = default;
  int rank() const { return rank_; }
  int size() const { return size_; }
  /// Rank 0 prints messages and writes files for all ranks.
  bool is_first() const { return rank_ == 0; }

  /// Sends to[r] to rank r, for every r including this rank. Returns the bytes received from each rank, in order of
  /// rank. Throws RankLost if a rank has left, and Error if the connection breaks.
  std::vector<Bytes> exchange(std::span<const ByteView> to);
  /// Sends the same bytes to every rank. Returns the bytes of all ranks, in order of rank.
  std::vector<Bytes> all_gather(ByteView mine);
  /// Broadcasts `mine` of `rank` to every rank and returns it. `mine` of the other ranks is ignored.
  Bytes broadcast(int rank, ByteView mine);

  /// Tells the other ranks that this rank fails and why: their current or next exchange throws RankLost. Returns false
  /// if the connection is broken, so that they cannot be told. No exchange is possible afterwards.
  bool leave(std::string_view why) noexcept;
  /// Returns whether communication has ended, so that no exchange is possible.
  bool ended() const { return ended_; }

  /// Number of bytes sent to other ranks so far.
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  /// Name of the library that transfers the bytes, for messages: "Open MPI 4.1.4".
  const std::string& transport() const { return transport_; }

 protected:
  Ranks(int rank, int size, std::string transport) : rank_(rank), size_(size), transport_(std::move(transport)) {}
  /// Sends one number to each rank and receives one from each. Both [size].
  virtual void send_numbers(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) = 0;
  /// Sends and receives bytes. Both [size]. Each part of `from` has the length of the message that it receives.
  virtual void send_bytes(std::span<const ByteView> to, std::span<const std::span<std::byte>> from) = 0;

 private:
  std::vector<Bytes> exchange(std::span<const ByteView> to, bool leaving);
  int rank_, size_;
  std::string transport_;
  bool ended_ = false;
  std::uint64_t bytes_sent_ = 0;
};

/// Returns the ranks of a single process, which only sends to itself.
std::unique_ptr<Ranks> alone();

/// Convert a list of trivially copyable values to bytes and back. values_of throws Error if the number of bytes is not
/// a multiple of the size of a value.
template <typename T>
ByteView bytes_of(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(values));
}
template <typename T>
std::vector<T> values_of(ByteView bytes) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (bytes.size() % sizeof(T) != 0)
    throw Error("ranks: {} bytes are not a list of values of {} bytes; run the same build on all ranks", bytes.size(),
                sizeof(T));
  std::vector<T> values(bytes.size() / sizeof(T));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(values)).begin());
  return values;
}

}  // namespace trisoup::ranks
