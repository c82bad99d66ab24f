// Fixed-point sums of the kernels (shaders/common/fixed_point.h) on the host.
#pragma once

#include <cstdint>

namespace trisoup::train {

/// The low word of an empty sum.
inline constexpr std::uint32_t kFixedZero = 0x80000000u;

/// Value of a sum's low and high word; low words start at 2^31, the unit is 2^-44.
inline double fixed_sum(std::uint32_t low, std::uint32_t high) {
  const std::uint64_t words = (std::uint64_t(high) << 32 | low) - kFixedZero;
  return static_cast<double>(static_cast<std::int64_t>(words)) * 0x1p-44;
}

}  // namespace trisoup::train
