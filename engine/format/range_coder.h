// Adaptive binary range coder (Martin 1979; carry handling as in LZMA). web/lattice.js has the same decoder.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trisoup::soup {

/// Adaptive probability that a decision is false. At first the mean of all decisions, later an exponential average.
class Chance {
 public:
  static constexpr std::uint32_t kBits = 15;
  std::uint32_t of_false() const { return p_; }
  void learn(bool decision) {
    const int target = decision ? 0 : 1 << kBits;
    p_ = static_cast<std::uint16_t>(
        std::clamp(p_ + (((target - p_) * kRates[seen_]) >> 16), kLeast, (1 << kBits) - kLeast));
    if (seen_ < kMostSeen) ++seen_;
  }

 private:
  static constexpr int kLeast = 32, kMostSeen = 120;
  /// 1 / (seen + 1.5) as 16-bit fixed point.
  static constexpr std::array<int, kMostSeen + 1> kRates = [] {
    std::array<int, kMostSeen + 1> rates{};
    for (int seen = 0; seen <= kMostSeen; ++seen) rates[static_cast<std::size_t>(seen)] = 131072 / (2 * seen + 3);
    return rates;
  }();
  std::uint16_t p_ = 1 << (kBits - 1);
  std::uint8_t seen_ = 0;
};

class RangeEncoder {
 public:
  void code(Chance& chance, bool decision) {
    const std::uint32_t bound = (range_ >> Chance::kBits) * chance.of_false();
    if (decision) {
      low_ += bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    chance.learn(decision);
    while (range_ < 1u << 24) {
      range_ <<= 8;
      shift();
    }
  }
  /// Same interface as RangeDecoder::decide, for code shared by both directions.
  bool decide(Chance& chance, bool decision) {
    code(chance, decision);
    return decision;
  }
  /// Returns the bytes of all decisions. No more decisions can be coded afterwards.
  std::vector<std::byte> finish() {
    for (int i = 0; i < 5; ++i) shift();
    return std::move(bytes_);
  }

 private:
  /// Outputs the top byte of `low_` once no carry can change it.
  void shift() {
    if (low_ < 0xff000000u || low_ >> 32 != 0) {
      const auto carry = static_cast<std::uint8_t>(low_ >> 32);
      for (; waiting_ > 0; --waiting_) {
        bytes_.push_back(static_cast<std::byte>(static_cast<std::uint8_t>(first_ + carry)));
        first_ = 0xff;
      }
      first_ = static_cast<std::uint8_t>(low_ >> 24);
    }
    ++waiting_;
    low_ = (low_ & 0x00ffffffu) << 8;
  }

  std::vector<std::byte> bytes_;
  std::uint64_t low_ = 0, waiting_ = 1;
  std::uint32_t range_ = 0xffffffffu;
  std::uint8_t first_ = 0;
};

class RangeDecoder {
 public:
  /// `bytes` must outlive the decoder. Past their end it reads zeros.
  explicit RangeDecoder(std::span<const std::byte> bytes) : bytes_(bytes) {
    for (int i = 0; i < 5; ++i) code_ = code_ << 8 | next();
  }
  bool decision(Chance& chance) {
    const std::uint32_t bound = (range_ >> Chance::kBits) * chance.of_false();
    const bool decision = code_ >= bound;
    if (decision) {
      code_ -= bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    chance.learn(decision);
    while (range_ < 1u << 24) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
    return decision;
  }
  bool decide(Chance& chance, bool) { return decision(chance); }
  /// Number of bytes read past the end.
  std::size_t missing() const { return at_ > bytes_.size() ? at_ - bytes_.size() : 0; }

 private:
  std::uint32_t next() {
    const std::size_t at = at_++;
    return at < bytes_.size() ? static_cast<std::uint32_t>(bytes_[at]) : 0;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t code_ = 0, range_ = 0xffffffffu;
};

}  // namespace trisoup::soup
