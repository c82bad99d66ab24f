// Writes to device memory that come with a launch, so that the host need not wait for a copy.
#pragma once

#include <array>
#include <cstdint>

namespace trisoup::gpu::cuda {

/// Words that a launch carries by itself.
struct SmallWrite {
  static constexpr std::uint32_t kMostWords = 256;
  std::array<std::uint32_t, kMostWords> words;
  std::uint32_t count;
};

/// On a cudaStream_t. to: 4-byte aligned.
void write_small(void* stream, std::uint32_t* to, const SmallWrite& write);
void fill_words(void* stream, std::uint32_t* to, std::uint64_t count, std::uint32_t value);

}  // namespace trisoup::gpu::cuda
