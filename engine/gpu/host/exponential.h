// e^x for one float or a vector of floats. Unlike library functions, it gives the same bits for both and on every
// machine.
#pragma once

#include <bit>
#include <cstdint>
#include <limits>

namespace trisoup::gpu::host {

/// F: float or a vector of floats. U: the unsigned 32-bit type or vector of the same size. The error is at most 2 units
/// in the last place. Returns 0 below -87.33 and infinity above 88.72.
template <typename F, typename U>
[[gnu::always_inline]] inline F exponential_of(F x) {
  // x = n ln 2 + r with |r| <= ln 2 / 2. Adding kRound leaves n in the lowest bits. ln 2 is split into two parts so
  // that n times the first part is exact.
  constexpr float kRound = 12582912.0f;
  const F low = x < -87.33f ? F{} - 87.33f : x;
  const F clamped = low > 88.72f ? F{} + 88.72f : low;
  const F shifted = clamped * 1.44269504f + kRound;
  const F n = shifted - kRound;
  const F r = (clamped - n * 0.693359375f) + n * 2.12194440e-4f;
  // Polynomial of Cephes (Moshier 1989).
  F p = r * 1.9875691500e-4f + 1.3981999507e-3f;
  p = p * r + 8.3334519073e-3f;
  p = p * r + 4.1665795894e-2f;
  p = p * r + 1.6666665459e-1f;
  p = p * r + 5.0000001201e-1f;
  p = p * (r * r) + r + 1.0f;
  F result = std::bit_cast<F>(std::bit_cast<U>(p) + (std::bit_cast<U>(shifted) << 23));
  result = x < -87.33f ? F{} : result;
  result = x > 88.72f ? F{} + std::numeric_limits<float>::infinity() : result;
  return x == x ? result : x;
}

[[gnu::always_inline]] inline float exponential(float x) { return exponential_of<float, std::uint32_t>(x); }

}  // namespace trisoup::gpu::host
