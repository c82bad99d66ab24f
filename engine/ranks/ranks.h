// Processes that train one soup together, usually on several machines, and what they tell each other. How bytes travel
// is for the implementations to say: MPI (launched.h), or threads of one process in the tests. Kernels know nothing of
// it.
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

/// Thrown on every rank where one could not go on. The message names that rank: "rank 2 of 4 (node17): what went
/// wrong".
class RankLost : public Error {
 public:
  explicit RankLost(const std::string& message) : Error("{}", message) {}
};

/// All ranks make the same calls in the same order: each call waits for the others. Not thread-safe.
class Ranks {
 public:
  virtual ~Ranks() = default;
  int rank() const { return rank_; }
  int size() const { return size_; }
  /// Who speaks for all, and writes their files.
  bool is_first() const { return rank_ == 0; }

  /// Sends to[r] to rank r, for every r (itself too), and returns what each rank has sent to this one, in order of
  /// rank. Throws RankLost where a rank has left, and Error where the connection breaks.
  std::vector<Bytes> exchange(std::span<const ByteView> to);
  /// The same bytes to every rank.
  std::vector<Bytes> gather(ByteView mine);
  /// What `rank` has, to every rank; `mine` of the others is not looked at.
  Bytes from(int rank, ByteView mine);

  /// Takes part in the exchange that the others are waiting in, or will come to, with nothing but `why` it ends. Theirs
  /// throws. False where nobody can be told, because the connection is broken. There is no exchange after it.
  bool leave(std::string_view why) noexcept;
  /// Whether there can be no exchange any more.
  bool ended() const { return ended_; }

  /// Sent to other ranks so far.
  std::uint64_t bytes_sent() const { return bytes_sent_; }
  /// What carries the bytes, for people: "Open MPI 4.1.4".
  const std::string& transport() const { return transport_; }

 protected:
  Ranks(int rank, int size, std::string transport) : rank_(rank), size_(size), transport_(std::move(transport)) {}
  /// One number to each rank and one from each. Both [size].
  virtual void send_numbers(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) = 0;
  /// Both [size]; each part of `from` is as long as what is sent to it.
  virtual void send_bytes(std::span<const ByteView> to, std::span<const std::span<std::byte>> from) = 0;

 private:
  std::vector<Bytes> exchange(std::span<const ByteView> to, bool leaving);
  int rank_, size_;
  std::string transport_;
  bool ended_ = false;
  std::uint64_t bytes_sent_ = 0;
};

/// A process by itself: what it sends, it receives.
std::unique_ptr<Ranks> alone();

/// The bytes of a list of plain values, and the values again. Throws Error where the bytes are not whole values.
template <typename T>
ByteView bytes_of(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::as_bytes(std::span(values));
}
template <typename T>
std::vector<T> values_of(ByteView bytes) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (bytes.size() % sizeof(T) != 0)
    throw Error("ranks: {} bytes are no list of values of {} bytes; all ranks have to run the same build", bytes.size(),
                sizeof(T));
  std::vector<T> values(bytes.size() / sizeof(T));
  std::copy(bytes.begin(), bytes.end(), std::as_writable_bytes(std::span(values)).begin());
  return values;
}

}  // namespace trisoup::ranks
