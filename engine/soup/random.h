// Random numbers that are the same on every machine. Integers come from a counter-based generator. Distributions are
// implemented here because those of the standard library differ between implementations.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Philox4x32-10: four 32-bit words that depend only on counter and key. Salmon, Moraes, Dror, Shaw, "Parallel Random
/// Numbers: As Easy as 1, 2, 3", SC 2011.
constexpr std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t even = 0xD2511F53ull * counter[0], odd = 0xCD9E8D57ull * counter[2];
    counter = {static_cast<std::uint32_t>(odd >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(odd),
               static_cast<std::uint32_t>(even >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(even)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

/// Returns a rotation from three uniform numbers in [0, 1). A unit quaternion uniform on the 3-sphere gives a rotation
/// uniform over SO(3). Shoemake, "Uniform Random Rotations", Graphics Gems III, 1992.
inline glm::dmat3 rotation_from_uniforms(double u1, double u2, double u3) {
  constexpr double kTwoPi = 6.283185307179586476925;
  const double x = std::sqrt(1.0 - u1) * std::sin(kTwoPi * u2), y = std::sqrt(1.0 - u1) * std::cos(kTwoPi * u2);
  const double z = std::sqrt(u1) * std::sin(kTwoPi * u3), w = std::sqrt(u1) * std::cos(kTwoPi * u3);
  return {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
          {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
          {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
}

/// A random stream identified by (seed, stream). Its only state is `position`, which a checkpoint can store.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0) : seed_(seed), stream_(stream) {}

  /// Number of words drawn so far. seek() continues the stream at a position.
  std::uint64_t position() const { return position_; }
  void seek(std::uint64_t position) { position_ = position; }

  /// Returns the next 32-bit word.
  std::uint32_t bits() {
    const std::uint64_t block = position_ / 4;
    const auto words = philox({static_cast<std::uint32_t>(block), static_cast<std::uint32_t>(block >> 32),
                               static_cast<std::uint32_t>(stream_), static_cast<std::uint32_t>(stream_ >> 32)},
                              {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
    return words[position_++ % 4];
  }

  /// Uniform in [0, 1), a multiple of 2^-24, so every value is exact as a float.
  float uniform01() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }

  /// Uniform in [low, high).
  float uniform(float low, float high) { return low + (high - low) * uniform01(); }

  /// Uniform integer in [0, bound), without bias; 0 if bound is 0. Lemire, "Fast Random Integer Generation in an
  /// Interval", 2019.
  std::uint32_t below(std::uint32_t bound) {
    std::uint64_t product = std::uint64_t{bits()} * bound;
    if (static_cast<std::uint32_t>(product) < bound) {
      const std::uint32_t threshold = (0u - bound) % bound;
      while (static_cast<std::uint32_t>(product) < threshold) product = std::uint64_t{bits()} * bound;
    }
    return static_cast<std::uint32_t>(product >> 32);
  }

  /// Uniform in the unit ball. Uses rejection, because sine functions differ between maths libraries.
  glm::vec3 in_sphere() {
    for (;;) {
      const float x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
      if (x * x + y * y + z * z <= 1.0f) return {x, y, z};
    }
  }

  /// Rotation uniform over SO(3). It is computed in double; rounding to float removes the differences between maths
  /// libraries.
  glm::dmat3 rotation() {
    const double u1 = uniform01(), u2 = uniform01(), u3 = uniform01();
    return rotation_from_uniforms(u1, u2, u3);
  }

  /// Fisher-Yates shuffle: every order is equally likely. At most 2^32 - 1 values.
  template <typename T>
  void shuffle(std::span<T> values) {
    for (std::size_t k = values.size(); k > 1; --k)
      std::swap(values[k - 1], values[below(static_cast<std::uint32_t>(k))]);
  }

 private:
  std::uint64_t seed_, stream_, position_ = 0;
};

}  // namespace trisoup::soup
