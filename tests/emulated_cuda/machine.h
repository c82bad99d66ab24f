// Emulates a GPU on one CPU thread. It runs the code that translate_ptx.py generates from PTX. It detects accesses to
// device, shared or local memory that are out of bounds or misaligned, data races, and barriers that not all threads of
// a workgroup reach.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "gpu/host/invocation.h"

namespace trisoup::emulated_cuda {

/// A position in the source: number of the file in its PTX << 20 | line.
using Place = std::uint32_t;

/// Instructions by the GPU unit that executes them: float addition and multiplication; division, roots and
/// exponentials; integer operations, comparisons and jumps; accesses to shared memory, including atomics; accesses to
/// device memory; accesses to local memory; atomics on device memory.
enum class Unit { multiply_add, special, other, shared, global, local, atomic };
constexpr std::size_t kUnits = 7;

struct Kernel {
  std::string_view name;  // mangled, as in PTX
  void (*run)(const std::byte*);
  std::vector<std::pair<std::size_t, std::size_t>> parameters;  // offset and size in bytes
  std::size_t parameter_bytes, shared_bytes, local_bytes;
  std::uint32_t most_threads;
  bool barriers;
  int module;
  std::vector<std::array<std::uint16_t, kUnits>> blocks;  // number of instructions in each basic block, by unit
};

/// Registers kernels during static initialisation.
struct Registration {
  Registration(std::initializer_list<Kernel> kernels);
};
struct SourceFile {
  SourceFile(int module, int number, const char* path);
};
/// Finds a kernel by its mangled name; null if there is none. Ignores the hash in names of anonymous namespaces,
/// because it differs between two compilations.
const Kernel* find_kernel(std::string_view name);
std::vector<const Kernel*> all_kernels();

/// Work of the warps of 32 threads in a kernel. Assumes that the nth execution of an instruction happens in all threads
/// of a warp together.
struct Counts {
  std::uint64_t launches = 0;
  std::array<std::uint64_t, kUnits> instructions{};  // instructions of warps
  std::uint64_t shared_wavefronts = 0;  // smallest number of passes over the 32 banks for accesses to shared memory
  std::uint64_t sectors = 0;            // sectors of 32 bytes in loads and stores of device memory
};

enum class Fault { none, memory, hazard };

class Machine {
 public:
  Machine();
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  /// Allocates device memory and fills it with an unlikely value. Returns 0 if there is not enough free memory or
  /// address space.
  std::uint64_t allocate(std::uint64_t bytes);
  /// Returns false if no allocation starts at this address.
  bool free(std::uint64_t address);
  bool holds(std::uint64_t address, std::uint64_t bytes) const;
  std::uint64_t total_bytes() const { return total_; }
  std::uint64_t free_bytes() const { return total_ - used_; }
  void set_total_bytes(std::uint64_t bytes) { total_ = bytes; }

  /// Runs a kernel to completion, or stops after the first workgroup with a fault.
  void run(const Kernel& kernel, std::uint32_t groups, std::uint32_t threads, const std::byte* arguments);
  /// The first fault since the start of the program or forget_findings(). Faults are also printed to stderr.
  Fault fault() const { return fault_; }
  const std::vector<std::string>& findings() const { return findings_; }
  void forget_findings();
  /// Starts counting, which slows kernels down. With TRISOUP_COUNTS=FILE in the environment, counting starts with the
  /// program, and the counts are written to that file at its end.
  void enable_counts() { counting_ = true; }
  /// Counts by readable name of the kernel.
  const std::map<std::string, Counts>& counts() const { return counts_; }

  // Functions for translated kernels. Invalid accesses read zero and write nothing. site: index of the access in the
  // kernel's code.
  std::uint32_t thread() const { return gpu::host::invocation.thread; }
  std::uint32_t group() const { return gpu::host::invocation.group; }
  std::uint32_t threads() const { return threads_; }
  std::uint32_t groups() const { return groups_; }
  std::uint64_t parameters(std::uint64_t offset) const { return reinterpret_cast<std::uint64_t>(arguments_) + offset; }

  template <typename T, std::size_t N>
  std::array<T, N> load_param(std::uint64_t at) const {
    return load<T, N>(at);
  }
  /// own: the local memory of the thread.
  template <typename T, std::size_t N>
  std::array<T, N> load_local(const std::byte* own, std::uint64_t at, Place place) {
    return in_local(own, at, sizeof(T) * N, place) ? load<T, N>(at) : std::array<T, N>{};
  }
  template <typename T, std::size_t N>
  void store_local(const std::byte* own, std::uint64_t at, const std::array<T, N>& values, Place place) {
    if (in_local(own, at, sizeof values, place)) std::memcpy(reinterpret_cast<void*>(at), values.data(), sizeof values);
  }
  template <typename T, std::size_t N>
  std::array<T, N> load_shared(std::uint64_t at, Place place, std::uint32_t site) {
    if (!in_shared(at, sizeof(T) * N, place)) return {};
    if (counting_) count_access(shared_sites_[site], at, sizeof(T) * N);
    for (std::uint64_t word = at / 4; word <= (at + sizeof(T) * N - 1) / 4; ++word)
      note_read(shared_shadow_[word], group_epoch_, "shared memory", place);
    return load<T, N>(reinterpret_cast<std::uint64_t>(shared_) + at);
  }
  template <typename T, std::size_t N>
  void store_shared(std::uint64_t at, const std::array<T, N>& values, Place place, std::uint32_t site) {
    if (!in_shared(at, sizeof values, place)) return;
    if (counting_) count_access(shared_sites_[site], at, sizeof values);
    const bool same = equal(load<T, N>(reinterpret_cast<std::uint64_t>(shared_) + at), values);
    for (std::uint64_t word = at / 4; word <= (at + sizeof values - 1) / 4; ++word)
      note_write(shared_shadow_[word], group_epoch_, false, same, "shared memory", place);
    std::memcpy(shared_ + at, values.data(), sizeof values);
  }
  template <typename T, std::size_t N>
  std::array<T, N> load_global(std::uint64_t at, Place place, std::uint32_t site) {
    if (at - base_ >= kArena && is_constant(at, sizeof(T) * N)) return load<T, N>(at);
    if (!in_global(at, sizeof(T) * N, place)) return {};
    if (counting_) count_access(global_sites_[site], at, sizeof(T) * N);
    for (std::uint64_t word = (at - base_) / 4; word <= (at - base_ + sizeof(T) * N - 1) / 4; ++word)
      note_read(shadow_[word], launch_epoch_, "device memory", place);
    return load<T, N>(at);
  }
  template <typename T, std::size_t N>
  void store_global(std::uint64_t at, const std::array<T, N>& values, Place place, std::uint32_t site) {
    if (!in_global(at, sizeof values, place)) return;
    if (counting_) count_access(global_sites_[site], at, sizeof values);
    for (std::size_t i = 0; i < N; ++i) {
      const std::uint64_t spot = at + i * sizeof(T);
      const bool same = equal<T, 1>(load<T, 1>(spot), {values[i]});
      for (std::uint64_t word = (spot - base_) / 4; word <= (spot - base_ + sizeof(T) - 1) / 4; ++word)
        note_write(shadow_[word], launch_epoch_, false, same, "device memory", place);
    }
    std::memcpy(reinterpret_cast<void*>(at), values.data(), sizeof values);
  }
  std::uint32_t atomic_add(std::uint64_t at, std::uint32_t value, Place place) {
    return atomic(at, place, [&](std::uint32_t before) { return before + value; });
  }
  std::uint32_t atomic_or(std::uint64_t at, std::uint32_t value, Place place) {
    return atomic(at, place, [&](std::uint32_t before) { return before | value; });
  }
  std::uint32_t atomic_max(std::uint64_t at, std::uint32_t value, Place place) {
    return atomic(at, place, [&](std::uint32_t before) { return std::max(before, value); });
  }
  std::uint32_t atomic_cas(std::uint64_t at, std::uint32_t expected, std::uint32_t value, Place place) {
    return atomic(at, place, [&](std::uint32_t before) { return before == expected ? value : before; });
  }
  std::uint32_t atomic_shared_add(std::uint64_t at, std::uint32_t value, Place place, std::uint32_t site) {
    return atomic_shared(at, place, site, [&](std::uint32_t before) { return before + value; });
  }
  std::uint32_t atomic_shared_max(std::uint64_t at, std::uint32_t value, Place place, std::uint32_t site) {
    return atomic_shared(at, place, site, [&](std::uint32_t before) { return std::max(before, value); });
  }
  /// Called at the start of a basic block.
  void block(std::uint32_t number) {
    if (counting_) count_block(number);
  }
  /// site: index of the barrier in the kernel's code.
  void barrier(std::uint32_t site, Place place);

 private:
  static constexpr std::size_t kSharedBytes = 48 << 10;
  static constexpr std::size_t kMostThreads = 1024;
  static constexpr std::uint64_t kArena = 6ull << 30, kBlock = 256;

  /// One access to a word. An epoch is the time between two barriers of a workgroup. Epochs increase across workgroups
  /// and launches.
  struct Touch {
    std::uint32_t epoch;
    std::uint16_t thread;
    bool atomic;
  };
  /// The first and the last access of each kind to a word.
  struct Word {
    Touch first_write, write, first_read, read;
  };

  std::uint32_t epoch() const { return group_epoch_ + barriers_passed_[thread()]; }
  /// Returns whether an earlier access and an access of this thread now are unordered. scope: the first epoch of the
  /// launch for device memory, or of the workgroup for shared memory.
  bool unordered(const Touch& before, std::uint32_t scope) const {
    return before.epoch >= scope &&
           (before.epoch < group_epoch_ || (before.epoch == epoch() && before.thread != thread()));
  }
  /// Stores `now` as the first access if later accesses can no longer conflict with the stored one.
  void note_first(Touch& first, const Touch& now, std::uint32_t scope) const {
    if (first.epoch < scope || (first.epoch >= group_epoch_ && first.epoch != now.epoch)) first = now;
  }
  void note_read(Word& word, std::uint32_t scope, const char* space, Place place) {
    if (unordered(word.write, scope) || unordered(word.first_write, scope))
      hazard("reads what another thread writes", space, place);
    const Touch now{epoch(), static_cast<std::uint16_t>(thread()), false};
    note_first(word.first_read, now, scope);
    word.read = now;
  }
  void note_write(Word& word, std::uint32_t scope, bool atomic, bool same, const char* space, Place place) {
    const auto collides = [&](const Touch& before) { return !(atomic && before.atomic) && unordered(before, scope); };
    if (!same && (collides(word.write) || collides(word.first_write)))
      hazard("writes what another thread writes", space, place);
    if (!same && (unordered(word.read, scope) || unordered(word.first_read, scope)))
      hazard("writes what another thread reads", space, place);
    if (same && unordered(word.write, scope))
      return;  // keeps the thread that changed the value, on which later readers depend
    const Touch now{epoch(), static_cast<std::uint16_t>(thread()), atomic};
    note_first(word.first_write, now, scope);
    word.write = now;
  }
  template <typename T, std::size_t N>
  static std::array<T, N> load(std::uint64_t at) {
    std::array<T, N> values;
    std::memcpy(values.data(), reinterpret_cast<const void*>(at), sizeof values);
    return values;
  }
  /// Compares bits.
  template <typename T, std::size_t N>
  static bool equal(const std::array<T, N>& a, const std::array<T, N>& b) {
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t,
                                    std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint16_t>>;
    static_assert(sizeof(T) == sizeof(Bits));
    bool same = true;
    for (std::size_t i = 0; i < N; ++i) same = same && std::bit_cast<Bits>(a[i]) == std::bit_cast<Bits>(b[i]);
    return same;
  }
  template <typename Change>
  std::uint32_t atomic(std::uint64_t at, Place place, Change change) {
    if (!in_global(at, 4, place)) return 0;
    const std::uint32_t before = load<std::uint32_t, 1>(at)[0], after = change(before);
    note_write(shadow_[(at - base_) / 4], launch_epoch_, true, false, "device memory", place);
    std::memcpy(reinterpret_cast<void*>(at), &after, 4);
    return before;
  }
  template <typename Change>
  std::uint32_t atomic_shared(std::uint64_t at, Place place, std::uint32_t site, Change change) {
    if (!in_shared(at, 4, place)) return 0;
    if (counting_) count_access(shared_sites_[site], at, 4);
    const std::uint32_t before = load<std::uint32_t, 1>(reinterpret_cast<std::uint64_t>(shared_) + at)[0],
                        after = change(before);
    note_write(shared_shadow_[at / 4], group_epoch_, true, false, "shared memory", place);
    std::memcpy(shared_ + at, &after, 4);
    return before;
  }
  bool in_shared(std::uint64_t at, std::size_t bytes, Place place) {
    if (at % bytes == 0 && at + bytes <= kernel_->shared_bytes) return true;
    refuse(at % bytes ? "a misaligned access to shared memory" : "an access outside of shared memory", place);
    return false;
  }
  bool in_local(const std::byte* own, std::uint64_t at, std::size_t bytes, Place place) {
    const auto start = reinterpret_cast<std::uint64_t>(own);
    if (at % bytes == 0 && at >= start && at + bytes <= start + kernel_->local_bytes) return true;
    refuse(at % bytes ? "a misaligned access to local memory" : "an access outside of local memory", place);
    return false;
  }
  bool in_global(std::uint64_t at, std::size_t bytes, Place place) {
    if (at - base_ < kArena && at % bytes == 0) {
      const std::uint32_t owner = owners_[(at - base_) / kBlock];
      if (owner != 0 && at + bytes <= ends_[owner]) return true;
    }
    refuse(at % bytes ? "a misaligned access to device memory" : "an access outside of every allocation", place);
    return false;
  }
  /// Accesses of one instruction by a warp between two barriers. Accesses that the threads make for the nth time count
  /// as simultaneous.
  struct Access {
    std::uint64_t at;
    std::uint32_t bytes, lane;
  };
  struct Site {
    std::uint32_t thread = ~0u;
    std::size_t turn = 0;
    std::vector<std::vector<Access>> turns;
  };
  static std::uint64_t wavefronts(const std::vector<Access>& turn);
  void count_block(std::uint32_t number);
  void count_access(Site& site, std::uint64_t at, std::uint32_t bytes);
  void next_warp();
  bool is_constant(std::uint64_t at, std::size_t bytes) const;
  void refuse(const char* what, Place place);
  void hazard(const char* what, const char* space, Place place);
  void say(Fault fault, const std::string& what, Place place);

  bool reserve_arena();

  std::uint64_t base_ = 0, total_ = 4ull << 30, used_ = 0, next_ = 0;
  Word* shadow_ = nullptr;                                     // one per four bytes of device memory
  std::uint32_t* owners_ = nullptr;                            // number of the allocation of each block, or 0
  std::vector<std::uint64_t> ends_{0};                         // end of each allocation, by number
  std::vector<std::pair<std::uint64_t, std::uint64_t>> live_;  // address and size, sorted by address

  const Kernel* kernel_ = nullptr;
  const std::byte* arguments_ = nullptr;
  std::uint32_t groups_ = 0, threads_ = 0;
  std::uint32_t launch_epoch_ = 1, group_epoch_ = 1;
  std::array<std::uint32_t, kMostThreads> barriers_passed_{};
  std::vector<std::uint32_t> barrier_sites_;  // sites of the barriers that the workgroup reached, in order
  alignas(16) std::byte shared_[kSharedBytes];
  std::array<Word, kSharedBytes / 4> shared_shadow_{};
  /// Runs workgroups in reverse order, because a GPU guarantees no order. Set by TRISOUP_BACKWARDS in the environment.
  bool backwards_ = false;
  bool counting_ = false;
  std::map<std::string, Counts> counts_;
  Counts* counted_ = nullptr;  // counts of the running kernel
  std::uint32_t warp_ = 0, warp_epoch_ = 0;
  std::unordered_map<std::uint32_t, Site> shared_sites_, global_sites_;  // by index in the kernel's code
  std::vector<std::array<std::uint32_t, 32>> block_runs_;  // executions of each block by each thread of the warp
  std::set<std::pair<std::string, Place>> said_;
  std::vector<std::string> findings_;
  Fault fault_ = Fault::none;
};

extern Machine machine;

/// Registers constant memory of a module, which kernels may only read.
struct Constant {
  Constant(const void* data, std::size_t bytes);
};

// Results of single instructions.
inline float fma_down(float a, float b, float c) {                       // rounds towards minus infinity
  const double product = static_cast<double>(a) * b, sum = product + c;  // the product is exact
  const double part = sum - product, lost = (product - (sum - part)) + (c - part);
  const float near = static_cast<float>(sum);
  return near > sum || (near == sum && lost < 0) ? std::nextafter(near, -INFINITY) : near;
}
inline float flushed(float x) { return std::fabs(x) < 0x1p-126f ? std::copysign(0.0f, x) : x; }
inline float exp2_flushed(float x) { return flushed(std::exp2(flushed(x))); }
inline float min_number(float a, float b) { return a == b ? (std::signbit(a) ? a : b) : std::fmin(a, b); }
inline float max_number(float a, float b) { return a == b ? (std::signbit(a) ? b : a) : std::fmax(a, b); }
inline float saturate(float x) { return x > 0 ? (x < 1 ? x : 1.0f) : 0.0f; }  // NaN gives 0
inline std::int32_t to_int32_t(float x) {
  return std::isnan(x) ? 0 : x >= 0x1p31f ? INT32_MAX : x < -0x1p31f ? INT32_MIN : static_cast<std::int32_t>(x);
}
inline std::uint32_t to_uint32_t(float x) {
  return !(x > 0) ? 0 : x >= 0x1p32f ? UINT32_MAX : static_cast<std::uint32_t>(x);
}
inline std::uint32_t divide(std::uint32_t a, std::uint32_t b) { return b == 0 ? ~0u : a / b; }
inline std::uint32_t remainder(std::uint32_t a, std::uint32_t b) { return b == 0 ? a : a % b; }
template <typename T>
T shift_left(T x, std::uint32_t by) {
  return by < 8 * sizeof(T) ? static_cast<T>(x << by) : T{0};
}
template <typename T>
T shift_right(T x, std::uint32_t by) {
  constexpr std::uint32_t kBits = 8 * sizeof(T);
  if (by >= kBits) return static_cast<T>(std::is_signed_v<T> && x < 0 ? -1 : 0);
  return static_cast<T>(x >> by);
}
inline std::uint32_t insert_bits(std::uint32_t from, std::uint32_t into, std::uint32_t position, std::uint32_t length) {
  position &= 255, length &= 255;
  const std::uint32_t mask = length >= 32 ? ~0u : (1u << length) - 1;
  return (into & ~shift_left(mask, position)) | shift_left(from & mask, position);
}
inline std::uint32_t reverse_bits(std::uint32_t x) {
  std::uint32_t reversed = 0;
  for (int i = 0; i < 32; ++i) reversed |= (x >> i & 1) << (31 - i);
  return reversed;
}
inline std::uint32_t shift_of_first_bit(std::uint32_t x) {
  return x == 0 ? ~0u : static_cast<std::uint32_t>(std::countl_zero(x));
}

}  // namespace trisoup::emulated_cuda
