// What a device's allocations throw when there is no room. Not in device.h: nvcc cannot read fmt.
#pragma once

#include <cstdint>
#include <utility>

#include "base/error.h"

namespace trisoup::gpu {

/// Device memory has run out.
class OutOfMemory : public Error {
 public:
  /// needed: bytes that the program would hold with what it asked for; available: that it could hold, as far as is
  /// known.
  template <typename... Args>
  OutOfMemory(std::uint64_t needed, std::uint64_t available, fmt::format_string<Args...> format, Args&&... args)
      : Error(format, std::forward<Args>(args)...), needed(needed), available(available) {}
  std::uint64_t needed, available;
};

}  // namespace trisoup::gpu
