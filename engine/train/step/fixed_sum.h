// Reads the kernels' fixed-point sums (shaders/common/fixed_point.h) on the host.
#pragma once

#include <cstdint>

namespace trisoup::train {

/// Low word of a sum that is 0. The high word is 0.
inline constexpr std::uint32_t kFixedZero = 0x80000000u;

/// Value of a sum with these low and high words. Low words start at 2^31; the unit is 2^-44.
inline double fixed_sum(std::uint32_t low, std::uint32_t high) {
  const std::uint64_t words = (std::uint64_t(high) << 32 | low) - kFixedZero;
  return static_cast<double>(static_cast<std::int64_t>(words)) * 0x1p-44;
}

}  // namespace trisoup::train
