// Reads little-endian values from memory with bounds checks.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

#include "base/error.h"

namespace trisoup::scene {

class ByteCursor {
 public:
  /// name: the file, for messages. kind: what a record is, for messages ("camera", "vertex").
  ByteCursor(std::span<const std::byte> bytes, std::string name, std::string kind)
      : bytes_(bytes), name_(std::move(name)), kind_(std::move(kind)) {}

  std::size_t remaining() const { return bytes_.size() - position_; }

  /// Returns the next value. Throws Error if the file ends before the end of the value.
  template <typename T>
  T read() {
    static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
    require(sizeof(T));
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }

  /// Returns the characters up to the next zero byte and skips that byte. Throws Error if there is none.
  std::string read_string() {
    const void* end = remaining() > 0 ? std::memchr(bytes_.data() + position_, 0, remaining()) : nullptr;
    if (end == nullptr) throw truncated();
    const auto* start = reinterpret_cast<const char*>(bytes_.data() + position_);
    std::string text(start, static_cast<const char*>(end));
    position_ += text.size() + 1;
    return text;
  }

  /// Returns a number of records, 64 bits. Throws Error if the remaining bytes cannot contain them, so that the number
  /// is safe for allocations.
  std::size_t read_count(std::size_t smallest_record) {
    const auto count = read<std::uint64_t>();
    if (count > remaining() / smallest_record)
      throw Error("{}: claims {} {} records in {} bytes; the file is cut off or damaged, export it again", name_, count,
                  kind_, remaining());
    return static_cast<std::size_t>(count);
  }

  /// Skips `count` records of `size` bytes. Throws Error if the file ends before the end of the records.
  void skip(std::uint64_t count, std::size_t size) {
    if (size == 0) return;
    if (count > remaining() / size) throw truncated();
    position_ += static_cast<std::size_t>(count) * size;
  }

 private:
  void require(std::size_t size) const {
    if (remaining() < size) throw truncated();
  }
  Error truncated() const {
    return Error("{}: ends in the middle of a {} record (byte {}); the file is cut off, copy or export it again", name_,
                 kind_, bytes_.size());
  }

  std::span<const std::byte> bytes_;
  std::string name_, kind_;
  std::size_t position_ = 0;
};

}  // namespace trisoup::scene
