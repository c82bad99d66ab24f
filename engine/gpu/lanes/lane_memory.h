// Loads, stores and atomics for lanes. A word has 4 bytes. A vector of N components in memory is N words. Loads may
// read up to WIDTH - 1 words before and after the required words; device buffers have padding on both sides for this
// (host_device.cpp).
#pragma once

#include "gpu/lanes/lanes.h"

namespace trisoup::gpu::host::LANES_NAMESPACE {
namespace {

typedef float four __attribute__((vector_size(16)));
typedef float four_in_memory __attribute__((vector_size(16), aligned(4), may_alias));
#define LANES_INLINE [[gnu::always_inline]] inline

template <typename T>
using lane_of = std::remove_cvref_t<decltype(T{}[0])>;

template <typename T>
LANES_INLINE T load_one(const char* p) {
  T x;
  std::memcpy(&x, p, sizeof x);
  return x;
}
template <Scalar T>
LANES_INLINE void store_one(char* p, T x) {
  std::memcpy(p, &x, sizeof x);
}
/// Stores all lanes to the same address: the value of the last active lane remains.
template <Lanes T>
inline void store_last(char* p, T x, vm mask) {
  const std::uint32_t lanes = lanes_of(mask);
  if (lanes == 0) return;
  const auto one = x[31 - std::countl_zero(lanes)];
  std::memcpy(p, &one, 4);
}
template <typename T, std::size_t stride>
LANES_INLINE T gather(const char* p, vu index) {
  T x;
  for (int l = 0; l < WIDTH; ++l) x[l] = load_one<lane_of<T>>(p + std::size_t(index[l]) * stride);
  return x;
}
/// Transposes a 4 x 4 matrix.
LANES_INLINE void transpose(four (&r)[4]) {
  const four t0 = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5), t1 = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5),
             t2 = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7), t3 = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
  r[0] = __builtin_shufflevector(t0, t1, 0, 1, 4, 5);
  r[1] = __builtin_shufflevector(t0, t1, 2, 3, 6, 7);
  r[2] = __builtin_shufflevector(t2, t3, 0, 1, 4, 5);
  r[3] = __builtin_shufflevector(t2, t3, 2, 3, 6, 7);
}
/// Joins component c of all blocks of four lanes into one vector of lanes. The values stay in registers.
template <Lanes T>
LANES_INLINE T joined(const four (&parts)[WIDTH / 4][4], int c) {
#if WIDTH == 4
  return (T)parts[0][c];
#elif WIDTH == 8
  return (T)__builtin_shufflevector(parts[0][c], parts[1][c], 0, 1, 2, 3, 4, 5, 6, 7);
#else
  typedef float eight __attribute__((vector_size(32)));
  const eight low = __builtin_shufflevector(parts[0][c], parts[1][c], 0, 1, 2, 3, 4, 5, 6, 7);
  const eight high = __builtin_shufflevector(parts[2][c], parts[3][c], 0, 1, 2, 3, 4, 5, 6, 7);
  return (T)__builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
#endif
}
/// Loads four consecutive words per lane, starting at at(l) for lane l, into four vectors.
template <Lanes T, typename At>
LANES_INLINE void load_four(At at, T& a, T& b, T& c, T& d) {
  four parts[WIDTH / 4][4];
  for (int block = 0; block < WIDTH / 4; ++block) {
    for (int l = 0; l < 4; ++l) parts[block][l] = *reinterpret_cast<const four_in_memory*>(at(4 * block + l));
    transpose(parts[block]);
  }
  a = joined<T>(parts, 0);
  b = joined<T>(parts, 1);
  c = joined<T>(parts, 2);
  d = joined<T>(parts, 3);
}
template <Lanes T, typename At>
LANES_INLINE void store_four(At at, T a, T b, T c, T d, std::uint32_t lanes) {
  const T columns[4] = {a, b, c, d};
  for (int block = 0; block < WIDTH; block += 4) {
    four rows[4];
    for (int c = 0; c < 4; ++c) std::memcpy(&rows[c], reinterpret_cast<const char*>(&columns[c]) + 4 * block, 16);
    transpose(rows);
    for (int l = 0; l < 4; ++l)
      if (lanes >> (block + l) & 1u) *reinterpret_cast<four_in_memory*>(at(block + l)) = rows[l];
  }
}
const std::uint32_t kAllLanes = (1u << WIDTH) - 1u;
template <std::size_t stride, Lanes T>
LANES_INLINE void gather_four(const char* p, vu index, T& a, T& b, T& c, T& d) {
  load_four([&](int l) { return p + std::size_t(index[l]) * stride; }, a, b, c, d);
}
/// Loads lane l from p + l * stride.
template <typename T, std::size_t stride>
LANES_INLINE T load_run(const char* p) {
  if constexpr (stride == 4) return load_one<T>(p);
  T x;
  for (int l = 0; l < WIDTH; ++l) x[l] = load_one<lane_of<T>>(p + std::size_t(l) * stride);
  return x;
}
#if WIDTH == 16
/// Lanes 0 to 7 load consecutive words from the index of lane 0, lanes 8 to 15 from the index of lane 8. If lane 0 or
/// 8 is inactive, its index may be negative (before `p`). A half without active lanes loads from `p`.
template <Lanes T>
LANES_INLINE T load_eights(const char* p, vu index, vm mask) {
  typedef float eight __attribute__((vector_size(32)));
  const std::uint32_t lanes = lanes_of(mask);
  const auto low = std::int32_t(lanes & 0xffu ? index[0] : 0), high = std::int32_t(lanes >> 8 ? index[8] : 0);
  return (T)__builtin_shufflevector(load_one<eight>(p + std::ptrdiff_t(low) * 4),
                                    load_one<eight>(p + std::ptrdiff_t(high) * 4), 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11,
                                    12, 13, 14, 15);
}
#endif
template <std::size_t stride, Lanes T>
LANES_INLINE void load_run_four(const char* p, T& a, T& b, T& c, T& d) {
  load_four([&](int l) { return p + std::size_t(l) * stride; }, a, b, c, d);
}
template <Lanes T, typename At>
inline void store_lanes(At at, T x, std::uint32_t lanes) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    store_one(at(l), static_cast<lane_of<T>>(x[l]));
  }
}
template <std::size_t stride, Lanes T>
inline void scatter(char* p, vu index, T x, vm mask) {
  store_lanes([&](int l) { return p + std::size_t(index[l]) * stride; }, x, lanes_of(mask));
}
template <std::size_t stride, Lanes T>
inline void scatter(char* p, vu index, T x) {
  for (int l = 0; l < WIDTH; ++l) store_one(p + std::size_t(index[l]) * stride, static_cast<lane_of<T>>(x[l]));
}
template <std::size_t stride, Lanes T>
inline void scatter_four(char* p, vu index, T a, T b, T c, T d, vm mask) {
  store_four([&](int l) { return p + std::size_t(index[l]) * stride; }, a, b, c, d, lanes_of(mask));
}
template <std::size_t stride, Lanes T>
inline void scatter_four(char* p, vu index, T a, T b, T c, T d) {
  store_four([&](int l) { return p + std::size_t(index[l]) * stride; }, a, b, c, d, kAllLanes);
}
template <std::size_t stride, Lanes T>
LANES_INLINE void store_run(char* p, T x) {
  if constexpr (stride == 4)
    std::memcpy(p, &x, sizeof x);
  else
    for (int l = 0; l < WIDTH; ++l) store_one(p + std::size_t(l) * stride, static_cast<lane_of<T>>(x[l]));
}
template <std::size_t stride, Lanes T>
inline void store_run(char* p, T x, vm mask) {
  if constexpr (stride == 4) {
    // Inactive lanes must not write: the memory may belong to another thread.
#if WIDTH == 16 && defined(__AVX512F__)
    _mm512_mask_storeu_epi32(p, static_cast<__mmask16>(lanes_of(mask)), (__m512i)x);
    return;
#else
    if (lanes_of(mask) == kAllLanes) {
      std::memcpy(p, &x, sizeof x);
      return;
    }
#if WIDTH == 8 && defined(__AVX2__)
    _mm256_maskstore_epi32(reinterpret_cast<int*>(p), (__m256i)mask.bits, (__m256i)x);
    return;
#endif
#endif
  }
  store_lanes([&](int l) { return p + std::size_t(l) * stride; }, x, lanes_of(mask));
}
template <std::size_t stride, Lanes T>
inline void store_run_four(char* p, T a, T b, T c, T d, vm mask) {
  store_four([&](int l) { return p + std::size_t(l) * stride; }, a, b, c, d, lanes_of(mask));
}
template <std::size_t stride, Lanes T>
inline void store_run_four(char* p, T a, T b, T c, T d) {
  store_four([&](int l) { return p + std::size_t(l) * stride; }, a, b, c, d, kAllLanes);
}

// ---- prefetch
LANES_INLINE void ask_for(const char* p) { __builtin_prefetch(p); }
template <std::size_t stride>
LANES_INLINE void ask_for_lanes(const char* p, vu index) {
  for (int l = 0; l < WIDTH; ++l) __builtin_prefetch(p + std::size_t(index[l]) * stride);
}

// ---- atomics: one lane after another
template <std::size_t stride, bool shared, bool used, typename F>
inline vu atomically(char* p, vu index, vu value, vm mask, F f) {
  vu before{};
  // An atomic instruction stalls the CPU until its cache line arrives, so the lines of all lanes are prefetched.
  if constexpr (!shared)
    for (int l = 0; l < WIDTH; ++l) __builtin_prefetch(p + std::size_t(index[l]) * stride, 1);
  for (std::uint32_t lanes = lanes_of(mask); lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    auto& word = *reinterpret_cast<std::uint32_t*>(p + std::size_t(index[l]) * stride);
    const std::uint32_t old = f(word, value[l]);
    if constexpr (used) before[l] = old;
  }
  return before;
}
/// Compare-and-swap: replaces words equal to `expected` by `value`. Returns the old words.
template <std::size_t stride, bool shared, bool used>
inline vu atomic_exchange_if(char* p, vu index, vu value, vu expected, vm mask) {
  vu before{};
  for (std::uint32_t lanes = lanes_of(mask); lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    std::uint32_t was = expected[l];
    std::atomic_ref<std::uint32_t>(*reinterpret_cast<std::uint32_t*>(p + std::size_t(index[l]) * stride))
        .compare_exchange_strong(was, value[l], std::memory_order_relaxed);
    before[l] = was;
  }
  return before;
}
template <std::size_t stride, bool shared, bool used>
inline vu atomic_add(char* p, vu index, vu value, vm mask) {
  return atomically<stride, shared, used>(p, index, value, mask, [](std::uint32_t& word, std::uint32_t x) {
    if constexpr (shared)
      return std::exchange(word, word + x);
    else
      return std::atomic_ref<std::uint32_t>(word).fetch_add(x, std::memory_order_relaxed);
  });
}
template <std::size_t stride, bool shared, bool used>
inline vu atomic_or(char* p, vu index, vu value, vm mask) {
  return atomically<stride, shared, used>(p, index, value, mask, [](std::uint32_t& word, std::uint32_t x) {
    return std::atomic_ref<std::uint32_t>(word).fetch_or(x, std::memory_order_relaxed);
  });
}
template <std::size_t stride, bool shared, bool used>
inline vu atomic_max(char* p, vu index, vu value, vm mask) {
  return atomically<stride, shared, used>(p, index, value, mask, [](std::uint32_t& word, std::uint32_t x) {
    const std::atomic_ref<std::uint32_t> shared_word(word);
    std::uint32_t before = shared_word.load(std::memory_order_relaxed);
    while (before < x && !shared_word.compare_exchange_weak(before, x, std::memory_order_relaxed)) {
    }
    return before;
  });
}

}  // namespace
}  // namespace trisoup::gpu::host::LANES_NAMESPACE
