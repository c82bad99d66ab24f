// Types and functions for translated kernels: vectors of WIDTH lanes, with one invocation per lane. Included once for
// each width, with WIDTH defined. All operations are correctly rounded or built from such operations, so that all
// widths give the same bits.
#pragma once

#include <atomic>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "gpu/compiled_kernels.h"
#include "gpu/host/exponential.h"
#include "gpu/host/invocation.h"

#define LANES_NAMESPACE_OF_(width) lanes##width
#define LANES_NAMESPACE_OF(width) LANES_NAMESPACE_OF_(width)
#define LANES_NAMESPACE LANES_NAMESPACE_OF(WIDTH)

namespace trisoup::gpu::host::LANES_NAMESPACE {
namespace {

typedef float vf __attribute__((vector_size(4 * WIDTH)));
typedef std::uint32_t vu __attribute__((vector_size(4 * WIDTH)));
typedef std::int32_t vi __attribute__((vector_size(4 * WIDTH)));
// Mask of active lanes: all bits of a lane are set or none. A struct, so that it is a type distinct from vi.
struct vm {
  vi bits;
};

using ptr = char*;

template <typename T, int N>
struct vec {
  T c[N];
};
template <typename T, int N>
struct arr {
  T v[N];
};

template <typename T>
concept Lanes = std::is_same_v<T, vf> || std::is_same_v<T, vu> || std::is_same_v<T, vi>;
template <typename T>
concept Scalar = std::is_arithmetic_v<T>;

// ---- masks
const vm kAll{~vi{}};
inline vm operator&(vm a, vm b) { return {a.bits & b.bits}; }
inline vm operator|(vm a, vm b) { return {a.bits | b.bits}; }
inline vm operator^(vm a, vm b) { return {a.bits ^ b.bits}; }
inline vm operator~(vm a) { return {~a.bits}; }
inline vm& operator|=(vm& a, vm b) { return a = a | b; }
inline std::uint32_t lanes_of(vm m) {
#if WIDTH == 16 && defined(__AVX512F__)
  return _mm512_movepi32_mask((__m512i)m.bits);
#elif WIDTH == 8 && defined(__AVX__)
  return static_cast<std::uint32_t>(_mm256_movemask_ps((__m256)m.bits));
#elif WIDTH == 4 && defined(__SSE2__)
  return static_cast<std::uint32_t>(_mm_movemask_ps((__m128)m.bits));
#else
  std::uint32_t lanes = 0;
  for (int l = 0; l < WIDTH; ++l) lanes |= m.bits[l] ? 1u << l : 0u;
  return lanes;
#endif
}
inline bool any(vm m) { return lanes_of(m) != 0; }

// ---- broadcast to all lanes, and the first lane
// x - 0 equals x for every x, so the compiler removes it. x + 0 changes -0, so the compiler must keep that addition.
inline vf vary(float x) { return x - vf{}; }
inline vu vary(std::uint32_t x) { return vu{} + x; }
inline vi vary(std::int32_t x) { return vi{} + x; }
inline vm vary(bool x) { return {x ? ~vi{} : vi{}}; }
template <Lanes T>
inline T vary(T x) {
  return x;
}
inline vm vary(vm x) { return x; }
template <typename T, int N>
inline auto vary(const vec<T, N>& x) {
  vec<decltype(vary(x.c[0])), N> r;
  for (int i = 0; i < N; ++i) r.c[i] = vary(x.c[i]);
  return r;
}
template <typename T, int N>
inline auto vary(const arr<T, N>& x) {
  arr<decltype(vary(x.v[0])), N> r;
  for (int i = 0; i < N; ++i) r.v[i] = vary(x.v[i]);
  return r;
}
template <Lanes T>
inline auto first(T x) {
  return x[0];
}
inline bool first(vm x) { return x.bits[0] != 0; }
template <typename T, int N>
inline auto first(const vec<T, N>& x) {
  vec<decltype(first(x.c[0])), N> r;
  for (int i = 0; i < N; ++i) r.c[i] = first(x.c[i]);
  return r;
}
inline vu lanes_from(std::uint32_t thread) {
  vu r;
  for (int l = 0; l < WIDTH; ++l) r[l] = thread + static_cast<std::uint32_t>(l);
  return r;
}
inline vu as_u(vu x) { return x; }
inline vu as_u(vi x) { return (vu)x; }
inline vu as_u(vm x) { return (vu)x.bits; }

// ---- selection
template <Scalar T>
inline T select(bool m, T a, T b) {
  return m ? a : b;
}
inline vf select(vm m, vf a, vf b) { return m.bits ? a : b; }
inline vu select(vm m, vu a, vu b) { return m.bits ? a : b; }
inline vi select(vm m, vi a, vi b) { return m.bits ? a : b; }
inline vm select(vm m, vm a, vm b) { return {(m.bits & a.bits) | (~m.bits & b.bits)}; }
template <typename M, typename T, int N>
inline vec<T, N> select(const M& m, const vec<T, N>& a, const vec<T, N>& b) {
  vec<T, N> r;
  for (int i = 0; i < N; ++i) {
    if constexpr (requires { m.c[0]; })
      r.c[i] = select(m.c[i], a.c[i], b.c[i]);
    else
      r.c[i] = select(m, a.c[i], b.c[i]);
  }
  return r;
}
template <typename T, int N>
inline arr<T, N> select(vm m, const arr<T, N>& a, const arr<T, N>& b) {
  arr<T, N> r;
  for (int i = 0; i < N; ++i) r.v[i] = select(m, a.v[i], b.v[i]);
  return r;
}

// ---- element by element
template <typename T, int N, typename F>
inline auto each(const vec<T, N>& a, F f) {
  vec<decltype(f(a.c[0])), N> r;
  for (int i = 0; i < N; ++i) r.c[i] = f(a.c[i]);
  return r;
}
template <typename T, typename U, int N, typename F>
inline auto each(const vec<T, N>& a, const vec<U, N>& b, F f) {
  vec<decltype(f(a.c[0], b.c[0])), N> r;
  for (int i = 0; i < N; ++i) r.c[i] = f(a.c[i], b.c[i]);
  return r;
}
#define LANES_BINARY(op)                                                                \
  template <typename T, int N>                                                          \
  inline vec<T, N> operator op(const vec<T, N>& a, const vec<T, N>& b) {                \
    return each(a, b, [](auto x, auto y) { return static_cast<decltype(x)>(x op y); }); \
  }
LANES_BINARY(+)
LANES_BINARY(-)
LANES_BINARY(*)
LANES_BINARY(/)
LANES_BINARY(&)
LANES_BINARY(|)
LANES_BINARY(^)
#undef LANES_BINARY
template <typename T, int N>
inline vec<T, N> operator-(const vec<T, N>& a) {
  return each(a, [](auto x) { return -x; });
}
template <typename T, typename S, int N>
inline vec<T, N> scale(const vec<T, N>& a, const S& s) {
  if constexpr (requires { a.c[0] * s; })
    return each(a, [&](auto x) { return x * s; });
  else
    return each(a, [&](auto x) { return scale(x, s); });
}
template <typename F>
inline bool compare(float a, float b, F f) {
  return f(a, b);
}
template <typename F>
inline bool compare(std::uint32_t a, std::uint32_t b, F f) {
  return f(a, b);
}
template <typename F>
inline bool compare(std::int32_t a, std::int32_t b, F f) {
  return f(a, b);
}
template <Lanes T, typename F>
inline vm compare(T a, T b, F f) {
  return {(vi)f(a, b)};
}
template <typename T, int N, typename F>
inline auto compare(const vec<T, N>& a, const vec<T, N>& b, F f) {
  return each(a, b, [&](auto x, auto y) { return compare(x, y, f); });
}
inline bool not_(bool x) { return !x; }
inline vm not_(vm x) { return ~x; }
template <typename T, int N>
inline vec<T, N> not_(const vec<T, N>& x) {
  return each(x, [](auto y) { return not_(y); });
}
template <typename T, int N>
inline T any_of(const vec<T, N>& x) {
  T r = x.c[0];
  for (int i = 1; i < N; ++i) r = r | x.c[i];
  return r;
}
template <typename T, int N>
inline T all_of(const vec<T, N>& x) {
  T r = x.c[0];
  for (int i = 1; i < N; ++i) r = r & x.c[i];
  return r;
}

// ---- functions. Minimum and maximum treat equal values and NaN as GLM does.
template <typename T>
requires Scalar<T> || Lanes<T>
inline T lesser(T a, T b) {
  if constexpr (Scalar<T>)
    return b < a ? b : a;
  else
    return (vi)(b < a) ? b : a;
}
template <typename T>
requires Scalar<T> || Lanes<T>
inline T greater(T a, T b) {
  if constexpr (Scalar<T>)
    return a < b ? b : a;
  else
    return (vi)(a < b) ? b : a;
}
#define LANES_TWO(name, function)                                     \
  template <typename T>                                               \
  requires Scalar<T> || Lanes<T>                                      \
  inline T name(T a, T b) { return function(a, b); }                  \
  template <typename T, int N>                                        \
  inline vec<T, N> name(const vec<T, N>& a, const vec<T, N>& b) {     \
    return each(a, b, [](auto x, auto y) { return function(x, y); }); \
  }
LANES_TWO(fmin_, lesser)
LANES_TWO(umin_, lesser)
LANES_TWO(smin_, lesser)
LANES_TWO(fmax_, greater)
LANES_TWO(umax_, greater)
LANES_TWO(smax_, greater)
#undef LANES_TWO
template <typename T>
inline T fclamp_(const T& x, const T& low, const T& high) {
  return fmin_(fmax_(x, low), high);
}
template <typename T>
inline T sclamp_(const T& x, const T& low, const T& high) {
  return fmin_(fmax_(x, low), high);
}
template <typename T>
inline T uclamp_(const T& x, const T& low, const T& high) {
  return fmin_(fmax_(x, low), high);
}

inline float fabs_one(float x) { return std::fabs(x); }
inline vf fabs_one(vf x) { return (vf)((vu)x & 0x7fffffffu); }
inline float fsign_one(float x) { return static_cast<float>((0.0f < x) - (x < 0.0f)); }
inline vf fsign_one(vf x) { return (vf)((vi)(x > 0.0f) & (vi)vary(1.0f)) - (vf)((vi)(x < 0.0f) & (vi)vary(1.0f)); }
inline float sqrt_one(float x) { return std::sqrt(x); }
inline vf sqrt_one(vf x) {
#if WIDTH == 16 && defined(__AVX512F__)
  return (vf)_mm512_sqrt_ps((__m512)x);
#elif WIDTH == 8 && defined(__AVX__)
  return (vf)_mm256_sqrt_ps((__m256)x);
#elif WIDTH == 4 && defined(__SSE2__)
  return (vf)_mm_sqrt_ps((__m128)x);
#else
  vf r;
  for (int l = 0; l < WIDTH; ++l) r[l] = std::sqrt(x[l]);
  return r;
#endif
}
inline float floor_one(float x) { return std::floor(x); }
inline float ceil_one(float x) { return std::ceil(x); }
/// The conversion to int works below 2^31. Larger floats are integers, infinite or NaN, and are returned unchanged.
inline vf floor_one(vf x) {
  const vf whole = __builtin_convertvector(__builtin_convertvector(x, vi), vf);
  const vf down = whole - (vf)((vi)(whole > x) & (vi)vary(1.0f));
  // Keeps the sign of zero. Floats of at least 2^23 have no fraction and are returned unchanged.
  const vi small = fabs_one(x) < 8388608.0f;
  const vf signed_ = (vf)((vu)down | ((vu)x & 0x80000000u & (vu)(down == 0.0f)));
  return small ? signed_ : x;
}
inline vf ceil_one(vf x) { return -floor_one(-x); }
inline float exp_one(float x) { return exponential(x); }
inline vf exp_one(vf x) { return exponential_of<vf, vu>(x); }
#define LANES_ONE(name)                                   \
  inline float name##_(float x) { return name##_one(x); } \
  inline vf name##_(vf x) { return name##_one(x); }       \
  template <typename T, int N>                            \
  inline vec<T, N> name##_(const vec<T, N>& x) {          \
    return each(x, [](auto y) { return name##_one(y); }); \
  }
LANES_ONE(fabs)
LANES_ONE(fsign)
LANES_ONE(sqrt)
LANES_ONE(floor)
LANES_ONE(ceil)
LANES_ONE(exp)
#undef LANES_ONE

template <typename T>
inline T dot_(const vec<T, 2>& a, const vec<T, 2>& b) {
  return a.c[0] * b.c[0] + a.c[1] * b.c[1];
}
template <typename T>
inline T dot_(const vec<T, 3>& a, const vec<T, 3>& b) {
  return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2];
}
template <typename T>
inline T dot_(const vec<T, 4>& a, const vec<T, 4>& b) {
  return (a.c[0] * b.c[0] + a.c[1] * b.c[1]) + (a.c[2] * b.c[2] + a.c[3] * b.c[3]);
}
template <typename T, int N>
inline vec<T, N> normalize_(const vec<T, N>& a) {
  return scale(a, 1.0f / sqrt_(dot_(a, a)));
}
template <typename T>
inline vec<T, 4> times(const vec<vec<T, 4>, 4>& m, const vec<T, 4>& v) {
  vec<T, 4> r;
  for (int i = 0; i < 4; ++i)
    r.c[i] = (m.c[0].c[i] * v.c[0] + m.c[1].c[i] * v.c[1]) + (m.c[2].c[i] * v.c[2] + m.c[3].c[i] * v.c[3]);
  return r;
}
template <typename T, int N, int M>
inline vec<vec<T, N>, M> outer(const vec<T, N>& a, const vec<T, M>& b) {
  vec<vec<T, N>, M> r;
  for (int j = 0; j < M; ++j) r.c[j] = scale(a, b.c[j]);
  return r;
}

template <Scalar T>
inline T div_(T a, T b) {
  return a / b;
}
template <Scalar T>
inline T mod_(T a, T b) {
  return a % b;
}
// Inactive lanes may contain any values, and no lane may trap.
template <Lanes T>
inline T div_(T a, T b) {
  T r;
  for (int l = 0; l < WIDTH; ++l)
    r[l] = b[l] == 0 ? 0 : b[l] + 1 == 0 && std::is_same_v<T, vi> ? 0 - a[l] : a[l] / b[l];
  return r;
}
template <Lanes T>
inline T mod_(T a, T b) {
  T r;
  for (int l = 0; l < WIDTH; ++l) r[l] = b[l] == 0 || (b[l] + 1 == 0 && std::is_same_v<T, vi>) ? 0 : a[l] % b[l];
  return r;
}
inline vi div_(vi a, std::int32_t b) { return div_(a, vary(b)); }
inline vi mod_(vi a, std::int32_t b) { return mod_(a, vary(b)); }
inline vu div_(vu a, std::uint32_t b) {
  if (__builtin_constant_p(b) && (b & (b - 1)) == 0) return a >> std::countr_zero(b);
  vu r;
  for (int l = 0; l < WIDTH; ++l) r[l] = a[l] / b;
  return r;
}
inline vu mod_(vu a, std::uint32_t b) {
  if (__builtin_constant_p(b) && (b & (b - 1)) == 0) return a & (b - 1);
  return a - div_(a, b) * b;
}
template <typename T, int N>
inline vec<T, N> div_(const vec<T, N>& a, const vec<T, N>& b) {
  return each(a, b, [](auto x, auto y) { return div_(x, y); });
}
template <typename T, int N>
inline vec<T, N> mod_(const vec<T, N>& a, const vec<T, N>& b) {
  return each(a, b, [](auto x, auto y) { return mod_(x, y); });
}
template <Scalar T, Scalar S>
inline T shift_left(T a, S n) {
  return a << n;
}
template <Scalar T, Scalar S>
inline T shift_right(T a, S n) {
  return a >> n;
}
template <Lanes T, Lanes S>
inline T shift_left(T a, S n) {
  return a << (T)n;
}
template <Lanes T, Lanes S>
inline T shift_right(T a, S n) {
  return a >> (T)n;
}
inline std::int32_t find_lsb_(std::uint32_t x) { return x == 0 ? -1 : std::countr_zero(x); }
inline vi find_lsb_(vu x) {
  // Converts the isolated lowest bit to float and reads the exponent.
  const vu lowest = x & -x;
  const vi exponent = (vi)(((vu) __builtin_convertvector((vi)lowest, vf) >> 23) & 255u) - 127;
  return (vi)(x == 0u) ? vi{} - 1 : exponent;
}

// ---- conversions
template <typename To, typename From>
inline To convert(const From& x) {
  if constexpr (Scalar<To>)
    return static_cast<To>(x);
  else if constexpr (Lanes<To>)
    return __builtin_convertvector(x, To);
  else {
    To r;
    for (std::size_t i = 0; i < sizeof(r.c) / sizeof(r.c[0]); ++i)
      r.c[i] = convert<std::remove_reference_t<decltype(r.c[0])>>(x.c[i]);
    return r;
  }
}
template <typename To, typename From>
inline To bits(const From& x) {
  if constexpr (Scalar<To>)
    return std::bit_cast<To>(x);
  else if constexpr (Lanes<To>)
    return (To)x;
  else {
    To r;
    for (std::size_t i = 0; i < sizeof(r.c) / sizeof(r.c[0]); ++i)
      r.c[i] = bits<std::remove_reference_t<decltype(r.c[0])>>(x.c[i]);
    return r;
  }
}

// ---- elements of local arrays with an index that differs between lanes
template <typename T, int N, typename A, typename Part>
inline T get_lanes(const A& array, vu index, Part part) {
  T r{};
  for (int i = 0; i < N; ++i) r = select(vm{(vi)(index == static_cast<std::uint32_t>(i))}, vary(part(array[i])), r);
  return r;
}
template <int N, typename A, typename Part, typename T>
inline void put_lanes(A& array, vu index, vm mask, Part part, const T& x) {
  for (int i = 0; i < N; ++i)
    part(array[i]) = select(mask & vm{(vi)(index == static_cast<std::uint32_t>(i))}, x, part(array[i]));
}

}  // namespace
}  // namespace trisoup::gpu::host::LANES_NAMESPACE
