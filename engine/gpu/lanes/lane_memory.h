// Loads, stores and atomics of lanes. Every word is of 4 bytes, and a vector of N components in memory is N words. A run of lanes may
// read up to WIDTH - 1 words before and beyond what it needs: device memory has so much room on both sides (host_device.cpp).
#pragma once

#include "gpu/lanes/lanes.h"

namespace trisoup::gpu::host::LANES_NAMESPACE(WIDTH) {
namespace {

typedef float four __attribute__((vector_size(16)));
typedef float four_in_memory __attribute__((vector_size(16), aligned(4), may_alias));

inline void load_one(const char* p, char*& x) { std::memcpy(&x, p, sizeof x); }
template <Scalar T>
inline void load_one(const char* p, T& x) { std::memcpy(&x, p, sizeof x); }
template <Scalar T, int N>
inline void load_one(const char* p, vec<T, N>& x) { std::memcpy(&x, p, sizeof x); }
template <Scalar T>
inline void store_one(char* p, T x) { std::memcpy(p, &x, sizeof x); }
template <Scalar T, int N>
inline void store_one(char* p, const vec<T, N>& x) { std::memcpy(p, &x, sizeof x); }
/// All lanes at one place: the last one's stays.
template <Lanes T>
inline void store_last(char* p, T x, vm mask) {
  const std::uint32_t lanes = lanes_of(mask);
  if (lanes == 0) return;
  const auto one = x[31 - std::countl_zero(lanes)];
  std::memcpy(p, &one, 4);
}
template <typename T, int N>
inline void store_last(char* p, const vec<T, N>& x, vm mask) {
  for (int i = 0; i < N; ++i) store_last(p + 4 * i, x.c[i], mask);
}
template <std::size_t stride, Lanes T>
inline void gather(const char* p, vu index, T& x) {
  for (int l = 0; l < WIDTH; ++l) {
    std::remove_cvref_t<decltype(x[0])> one;
    std::memcpy(&one, p + std::size_t(index[l]) * stride, 4);
    x[l] = one;
  }
}
/// Rows become columns.
inline void transpose(four (&r)[4]) {
  const four t0 = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5), t1 = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5),
             t2 = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7), t3 = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
  r[0] = __builtin_shufflevector(t0, t1, 0, 1, 4, 5);
  r[1] = __builtin_shufflevector(t0, t1, 2, 3, 6, 7);
  r[2] = __builtin_shufflevector(t2, t3, 0, 1, 4, 5);
  r[3] = __builtin_shufflevector(t2, t3, 2, 3, 6, 7);
}
/// Four words of each lane, that of lane l at at(l), as four vectors.
template <Lanes T, typename At>
inline void gather_four(At at, vec<T, 4>& x) {
  for (int block = 0; block < WIDTH; block += 4) {
    four rows[4];
    for (int l = 0; l < 4; ++l) rows[l] = *reinterpret_cast<const four_in_memory*>(at(block + l));
    transpose(rows);
    for (int c = 0; c < 4; ++c) std::memcpy(reinterpret_cast<char*>(&x.c[c]) + 4 * block, &rows[c], 16);
  }
}
template <Lanes T, typename At>
inline void scatter_four(At at, const vec<T, 4>& x, std::uint32_t lanes) {
  for (int block = 0; block < WIDTH; block += 4) {
    four rows[4];
    for (int c = 0; c < 4; ++c) std::memcpy(&rows[c], reinterpret_cast<const char*>(&x.c[c]) + 4 * block, 16);
    transpose(rows);
    for (int l = 0; l < 4; ++l)
      if (lanes >> (block + l) & 1u) *reinterpret_cast<four_in_memory*>(at(block + l)) = rows[l];
  }
}
template <std::size_t stride, Lanes T, int N>
inline void gather(const char* p, vu index, vec<T, N>& x) {
  if constexpr (N == 4) {
    gather_four([&](int l) { return p + std::size_t(index[l]) * stride; }, x);
  } else {
    for (int i = 0; i < N; ++i) gather<stride>(p + 4 * i, index, x.c[i]);
  }
}
/// Lane l at p + l * stride.
template <std::size_t stride, Lanes T>
inline void load_run(const char* p, T& x) {
  if constexpr (stride == 4) std::memcpy(&x, p, sizeof x);
  else {
    for (int l = 0; l < WIDTH; ++l) {
      std::remove_cvref_t<decltype(x[0])> one;
      std::memcpy(&one, p + std::size_t(l) * stride, 4);
      x[l] = one;
    }
  }
}
template <std::size_t stride, Lanes T, int N>
inline void load_run(const char* p, vec<T, N>& x) {
  if constexpr (N == 4) {
    gather_four([&](int l) { return p + std::size_t(l) * stride; }, x);
  } else {
    for (int i = 0; i < N; ++i) load_run<stride>(p + 4 * i, x.c[i]);
  }
}
template <std::size_t stride, Lanes T>
inline void scatter(char* p, vu index, T x, vm mask) {
  for (std::uint32_t lanes = lanes_of(mask); lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    const auto one = x[l];
    std::memcpy(p + std::size_t(index[l]) * stride, &one, 4);
  }
}
template <std::size_t stride, typename T, int N>
inline void scatter(char* p, vu index, const vec<T, N>& x, vm mask) {
  if constexpr (N == 4) scatter_four([&](int l) { return p + std::size_t(index[l]) * stride; }, x, lanes_of(mask));
  else for (int i = 0; i < N; ++i) scatter<stride>(p + 4 * i, index, x.c[i], mask);
}
template <std::size_t stride, Lanes T>
inline void store_run(char* p, T x) {
  if constexpr (stride == 4) std::memcpy(p, &x, sizeof x);
  else for (int l = 0; l < WIDTH; ++l) {
    const auto one = x[l];
    std::memcpy(p + std::size_t(l) * stride, &one, 4);
  }
}
template <std::size_t stride, Lanes T>
inline void store_run(char* p, T x, vm mask) {
  if constexpr (stride == 4) {
    // What lanes that take no part would write may be another thread's.
#if WIDTH == 16 && defined(__AVX512F__)
    _mm512_mask_storeu_epi32(p, static_cast<__mmask16>(lanes_of(mask)), (__m512i)x);
    return;
#else
    if (lanes_of(mask) == (1u << WIDTH) - 1u) {
      std::memcpy(p, &x, sizeof x);
      return;
    }
#if WIDTH == 8 && defined(__AVX2__)
    _mm256_maskstore_epi32(reinterpret_cast<int*>(p), (__m256i)mask.bits, (__m256i)x);
    return;
#endif
#endif
  }
  for (std::uint32_t lanes = lanes_of(mask); lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    const auto one = x[l];
    std::memcpy(p + std::size_t(l) * stride, &one, 4);
  }
}
template <std::size_t stride, typename T, int N>
inline void store_run(char* p, const vec<T, N>& x, vm mask = kAll) {
  if constexpr (N == 4) scatter_four([&](int l) { return p + std::size_t(l) * stride; }, x, lanes_of(mask));
  else for (int i = 0; i < N; ++i) store_run<stride>(p + 4 * i, x.c[i], mask);
}

// ---- atomics: lane after lane
template <std::size_t stride, bool shared, bool used, typename F>
inline vu atomically(char* p, vu index, vu value, vm mask, F f) {
  vu before{};
  for (std::uint32_t lanes = lanes_of(mask); lanes != 0; lanes &= lanes - 1) {
    const int l = std::countr_zero(lanes);
    auto& word = *reinterpret_cast<std::uint32_t*>(p + std::size_t(index[l]) * stride);
    const std::uint32_t old = f(word, value[l]);
    if constexpr (used) before[l] = old;
  }
  return before;
}
template <std::size_t stride, bool shared, bool used>
inline vu atomic_add(char* p, vu index, vu value, vm mask) {
  return atomically<stride, shared, used>(p, index, value, mask, [](std::uint32_t& word, std::uint32_t x) {
    if constexpr (shared) return std::exchange(word, word + x);
    else return std::atomic_ref<std::uint32_t>(word).fetch_add(x, std::memory_order_relaxed);
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
    while (before < x && !shared_word.compare_exchange_weak(before, x, std::memory_order_relaxed)) {}
    return before;
  });
}

}  // namespace
}  // namespace trisoup::gpu::host::LANES_NAMESPACE(WIDTH)
