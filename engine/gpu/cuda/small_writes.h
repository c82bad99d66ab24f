// Small writes to device memory whose data is passed as kernel arguments, so that the host does not wait for a copy.
#pragma once

#include <array>
#include <cstdint>

namespace trisoup::gpu::cuda {

/// Words passed by value to a kernel.
struct SmallWrite {
  static constexpr std::uint32_t kMostWords = 256;
  std::array<std::uint32_t, kMostWords> words;
  std::uint32_t count;
};

/// Both run on `stream`, a cudaStream_t. to: 4-byte aligned.
void write_small(void* stream, std::uint32_t* to, const SmallWrite& write);
void fill_words(void* stream, std::uint32_t* to, std::uint64_t count, std::uint32_t value);

}  // namespace trisoup::gpu::cuda
