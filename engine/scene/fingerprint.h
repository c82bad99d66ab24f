// A hash that distinguishes datasets.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace trisoup::scene {

/// 64-bit hash of the values added, in order (FNV-1a of Fowler, Noll and Vo).
class Fingerprint {
 public:
  void add(std::string_view text) {
    for (const char c : text) add_byte(static_cast<std::uint8_t>(c));
    add_byte(0);  // distinguishes "ab", "c" from "a", "bc"
  }
  /// Adds the value rounded to float, so that differences between implementations of tan() do not matter. Treats -0 as
  /// 0.
  void add(double value) { add_word(std::bit_cast<std::uint32_t>(static_cast<float>(value) + 0.0f)); }
  void add(int value) { add_word(static_cast<std::uint32_t>(value)); }
  /// Hashes eight bytes at a time for speed, because photographs are large.
  void add(std::span<const std::uint8_t> bytes) {
    for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data(), 8);
      hash_ = (hash_ ^ word) * 1099511628211u;
      hash_ ^= hash_ >> 29;
    }
    for (const std::uint8_t byte : bytes) add_byte(byte);
  }

  std::uint64_t value() const { return hash_; }

 private:
  void add_word(std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) add_byte(static_cast<std::uint8_t>(word >> shift));
  }
  void add_byte(std::uint8_t byte) { hash_ = (hash_ ^ byte) * 1099511628211u; }

  std::uint64_t hash_ = 14695981039346656037u;
};

}  // namespace trisoup::scene
