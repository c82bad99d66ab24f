// Definitions for compiling kernels as C++ with one lane: the threads of a workgroup take turns on one CPU thread
// (workgroup.h). Included before every kernel. common/kernel.h documents the macros.
#pragma once

#include <atomic>
#include <bit>

#include "gpu/host/exponential.h"
#include "gpu/host/invocation.h"

#define ELEMENTS(type, alignment) type*

#define KERNEL_TYPES trisoup::gpu::host
#include "gpu/kernel_words.h"

namespace trisoup::gpu::host {

inline float exp(float x) { return exponential(x); }
inline vec4 exp(vec4 v) { return vec4(exponential(v.x), exponential(v.y), exponential(v.z), exponential(v.w)); }
inline void memoryBarrierBuffer() {}
inline uint group_index() { return invocation.group; }
inline uint thread_index() { return invocation.group * 64u + invocation.thread; }
inline int findLSB(uint x) { return x == 0 ? -1 : std::countr_zero(x); }
inline uint atomicAdd(uint& x, uint value) {
  return std::atomic_ref<uint>(x).fetch_add(value, std::memory_order_relaxed);
}
inline uint atomicOr(uint& x, uint value) {
  return std::atomic_ref<uint>(x).fetch_or(value, std::memory_order_relaxed);
}
inline uint atomicCompSwap(uint& x, uint expected, uint value) {
  std::atomic_ref<uint>(x).compare_exchange_strong(expected, value, std::memory_order_relaxed);
  return expected;
}
inline uint atomicMax(uint& x, uint value) {
  const std::atomic_ref<uint> word(x);
  uint before = word.load(std::memory_order_relaxed);
  while (before < value && !word.compare_exchange_weak(before, value, std::memory_order_relaxed)) {
  }
  return before;
}

}  // namespace trisoup::gpu::host

#define gl_LocalInvocationIndex ::trisoup::gpu::host::invocation.thread
#define KERNEL_MAIN(threads)         \
  constexpr uint kThreads = threads; \
  inline void kernel([[maybe_unused]] const KernelArgs& a)
#define RUN_KERNEL \
  void run(const std::byte* arguments) { kernel(*reinterpret_cast<const KernelArgs*>(arguments)); }
#define SHARED [[maybe_unused]] static thread_local
#define MARK(word) std::atomic_ref<uint>(word).store(1u, std::memory_order_relaxed)
