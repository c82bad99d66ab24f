#include "gpu/cuda/small_writes.h"

#include <algorithm>

namespace trisoup::gpu::cuda {
namespace {

__global__ void write_kernel(std::uint32_t* to, const __grid_constant__ SmallWrite write) {
  if (threadIdx.x < write.count) to[threadIdx.x] = write.words.data()[threadIdx.x];
}

__global__ void fill_kernel(std::uint32_t* to, std::uint64_t count, std::uint32_t value) {
  const std::uint64_t stride = std::uint64_t{gridDim.x} * blockDim.x;
  for (std::uint64_t i = std::uint64_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += stride) to[i] = value;
}

}  // namespace

void write_small(void* stream, std::uint32_t* to, const SmallWrite& write) {
  write_kernel<<<1, SmallWrite::kMostWords, 0, static_cast<cudaStream_t>(stream)>>>(to, write);
}

void fill_words(void* stream, std::uint32_t* to, std::uint64_t count, std::uint32_t value) {
  constexpr std::uint64_t kMostGroups = 4096;
  const auto groups = static_cast<unsigned>(std::min<std::uint64_t>(kMostGroups, (count + 255) / 256));
  if (groups > 0) fill_kernel<<<groups, 256, 0, static_cast<cudaStream_t>(stream)>>>(to, count, value);
}

}  // namespace trisoup::gpu::cuda
