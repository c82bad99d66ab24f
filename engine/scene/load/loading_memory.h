// Compares the memory that photographs need with that of the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/memory.h"

namespace trisoup::scene {

struct LoadingNeed {
  std::size_t photographs = 0;
  std::uint64_t views = 0;     // bytes of all views at the size in which they are kept
  std::uint64_t decoding = 0;  // bytes of the photographs that are decoded at the same time
};

/// Returns the smallest `resolution` above `downscale`, in steps of two, with which the need is at most `bytes`; 0 if
/// there is none up to 64 times `downscale`. Decoding needs the same memory at any resolution.
double loading_resolution_that_fits(const LoadingNeed& need, double downscale, std::uint64_t bytes);

/// Throws Error if the need exceeds the available memory; the message says what is needed and a `resolution` that fits.
/// downscale: the resolution of the need. source: begins the message.
void check_loading_memory(const LoadingNeed& need, double downscale, const Memory& memory, const std::string& source);

}  // namespace trisoup::scene
