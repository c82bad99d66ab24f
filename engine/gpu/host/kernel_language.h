// The kernels' language for a C++ compiler: a workgroup's threads take turns on one thread of the CPU (workgroup.h).
// Included before any kernel; common/kernel.h says what the words in capitals mean.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <glm/glm.hpp>

#define TRISOUP_KERNEL_CODE
#define KERNEL_TYPES trisoup::gpu::host
#include "common/language.h"

namespace trisoup::gpu::host {

using real = float;
using uint = std::uint32_t;
using glm::abs;
using glm::ceil;
using glm::clamp;
using glm::cross;
using glm::dot;
using glm::exp;
using glm::floor;
using glm::greaterThan;
using glm::ivec2;
using glm::mat4;
using glm::max;
using glm::min;
using glm::normalize;
using glm::outerProduct;
using glm::sign;
using glm::sqrt;
using glm::uvec2;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

/// Which thread of which workgroup is running.
struct Invocation {
  uint thread = 0, group = 0;
};
extern thread_local Invocation invocation;

/// Lets the workgroup's other threads come as far.
void barrier();

inline void memoryBarrierBuffer() {}
inline uint group_index() { return invocation.group; }
inline uint thread_index() { return invocation.group * 64u + invocation.thread; }
inline int findLSB(uint x) { return x == 0 ? -1 : std::countr_zero(x); }
inline uint atomicAdd(uint& x, uint value) { return std::atomic_ref<uint>(x).fetch_add(value, std::memory_order_relaxed); }

}  // namespace trisoup::gpu::host

#define gl_LocalInvocationIndex ::trisoup::gpu::host::invocation.thread
#define KERNEL(threads, Args)       \
  constexpr uint kThreads = threads; \
  using KernelArgs = Args;          \
  inline void kernel([[maybe_unused]] const Args& a)
#define RUN_KERNEL void run(const std::byte* arguments) { kernel(*reinterpret_cast<const KernelArgs*>(arguments)); }
// The constants' values are those of the variant that is being compiled (the generated file defines them).
#define CONSTANT(id, type, name, value) [[maybe_unused]] constexpr type name = static_cast<type>(KERNEL_CONSTANT_##id)
#define SHARED [[maybe_unused]] static thread_local
#define COHERENT_POINTER(name, type) \
  struct name {                      \
    type* v;                         \
    template <typename Other>        \
    explicit name(Other o) : v(o.v) {} \
  };
