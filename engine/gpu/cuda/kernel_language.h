// The kernels' language for nvcc; common/kernel.h says what the words in capitals mean.
#pragma once

#include <cuda.h>  // before GLM, which otherwise takes the compiler for one that it does not know
#define GLM_FORCE_CUDA
#include <cstring>

namespace trisoup::gpu::cuda {

/// An array in device memory whose elements lie where GLSL's std430 has them. GLM's vectors are only as aligned as
/// floats, and nvcc reads four words at once only where it knows that they are aligned.
template <typename T, std::size_t alignment>
struct Elements {
  __device__ T& operator[](std::size_t i) const {
    return *static_cast<T*>(__builtin_assume_aligned(first + i, alignment));
  }
  T* first;
};

}  // namespace trisoup::gpu::cuda

#define ELEMENTS(type, alignment) ::trisoup::gpu::cuda::Elements<type, alignment>
#define KERNEL_TYPES trisoup::gpu::cuda
#include "gpu/kernel_words.h"

namespace trisoup::gpu::cuda {

using glm::exp;
__device__ inline void barrier() { __syncthreads(); }
__device__ inline void memoryBarrierBuffer() { __threadfence_block(); }
__device__ inline uint group_index() { return blockIdx.x; }
__device__ inline uint thread_index() { return blockIdx.x * 64u + threadIdx.x; }
__device__ inline int findLSB(uint x) { return __ffs(static_cast<int>(x)) - 1; }
__device__ inline uint atomicAdd(uint& x, uint value) { return ::atomicAdd(&x, value); }
__device__ inline uint atomicOr(uint& x, uint value) { return ::atomicOr(&x, value); }
__device__ inline uint atomicCompSwap(uint& x, uint expected, uint value) { return ::atomicCAS(&x, expected, value); }
__device__ inline uint atomicMax(uint& x, uint value) { return ::atomicMax(&x, value); }

}  // namespace trisoup::gpu::cuda

#define gl_LocalInvocationIndex threadIdx.x
#define KERNEL_MAIN(threads)         \
  constexpr uint kThreads = threads; \
  __global__ void __launch_bounds__(threads) kernel(const __grid_constant__ KernelArgs a)
#define RUN_KERNEL                                                           \
  void run(void* stream, std::uint32_t groups, const std::byte* arguments) { \
    KernelArgs a;                                                            \
    std::memcpy(&a, arguments, sizeof a);                                    \
    kernel<<<groups, kThreads, 0, static_cast<cudaStream_t>(stream)>>>(a);   \
  }                                                                          \
  const void* function() { return reinterpret_cast<const void*>(&kernel); }
#define SHARED __shared__ __align__(16)  // so that neighbouring words are read together
#define MARK(word) word = 1u
