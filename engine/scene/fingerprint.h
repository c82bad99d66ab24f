// One number that tells datasets apart.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace trisoup::scene {

/// 64-bit hash of what is added, in order (Fowler, Noll and Vo, FNV-1a).
class Fingerprint {
 public:
  void add(std::string_view text) {
    for (const char c : text) add_byte(static_cast<std::uint8_t>(c));
    add_byte(0);  // "ab", "c" and "a", "bc" differ
  }
  /// Rounded to float, so that the last bits of another library's tan() do not matter; +0 for -0.
  void add(double value) { add_word(std::bit_cast<std::uint32_t>(static_cast<float>(value) + 0.0f)); }
  void add(int value) { add_word(static_cast<std::uint32_t>(value)); }
  /// Eight bytes at a time: photographs are large.
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
