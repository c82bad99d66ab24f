// Definitions for compiling kernels with nvcc. common/kernel.h documents the macros.
#pragma once

#include <cuda.h>  // must precede GLM, which otherwise does not recognise the compiler
#define GLM_FORCE_CUDA
#include <cstring>

namespace trisoup::gpu::cuda {

/// An array in device memory with the element layout of GLSL's std430. GLM's vectors are aligned like floats, but nvcc
/// needs the real alignment to load four words at once.
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
#define SHARED __shared__ __align__(16)  // allows vector loads of neighbouring words
#define MARK(word) word = 1u
