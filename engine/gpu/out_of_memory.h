// The exception for failed device allocations. It is not in device.h because nvcc cannot compile fmt.
#pragma once

#include <cstdint>
#include <utility>

#include "base/error.h"

namespace trisoup::gpu {

/// Device memory has run out.
class OutOfMemory : public Error {
 public:
  /// needed: bytes that the program would hold with the failed allocation. available: bytes that it can hold, as far as
  /// known.
  template <typename... Args>
  OutOfMemory(std::uint64_t needed, std::uint64_t available, fmt::format_string<Args...> format, Args&&... args)
      : Error(format, std::forward<Args>(args)...), needed(needed), available(available) {}
  std::uint64_t needed, available;
};

}  // namespace trisoup::gpu
