#include "gpu/lanes/lane_kernels.h"

#include <cstdlib>

#include "base/error.h"

namespace trisoup::gpu::host {

#define LANE_KERNELS(width)                                   \
  std::span<const CompiledKernel> lane_kernels_##width##_0(); \
  std::span<const CompiledKernel> lane_kernels_##width##_1();
#if defined(TRISOUP_LANES_4)
LANE_KERNELS(4)
#endif
#if defined(TRISOUP_LANES_8)
LANE_KERNELS(8)
#endif
#if defined(TRISOUP_LANES_16)
LANE_KERNELS(16)
#endif
#undef LANE_KERNELS

namespace {

[[maybe_unused]] LaneKernels joined(std::uint32_t lanes, const char* instructions, bool usable,
                                    std::span<const CompiledKernel> a, std::span<const CompiledKernel> b) {
  LaneKernels set{lanes, instructions, usable, {a.begin(), a.end()}};
  set.kernels.insert(set.kernels.end(), b.begin(), b.end());
  // Kernels without a variant for this number of lanes run with one lane. find_compiled() takes the first match.
  const std::span<const CompiledKernel> single = compiled_kernels();
  set.kernels.insert(set.kernels.end(), single.begin(), single.end());
  return set;
}

std::vector<LaneKernels> find_lane_kernels() {
  std::vector<LaneKernels> sets;
#if defined(TRISOUP_LANES_16)
  sets.push_back(joined(16, "AVX-512",
                        __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                            __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"),
                        lane_kernels_16_0(), lane_kernels_16_1()));
#endif
#if defined(TRISOUP_LANES_8)
  sets.push_back(joined(8, "AVX2", __builtin_cpu_supports("avx2"), lane_kernels_8_0(), lane_kernels_8_1()));
#endif
#if defined(TRISOUP_LANES_4)
#if defined(__x86_64__)
  sets.push_back(joined(4, "SSE2", true, lane_kernels_4_0(), lane_kernels_4_1()));
#else
  sets.push_back(joined(4, "vectors of 128 bits", true, lane_kernels_4_0(), lane_kernels_4_1()));
#endif
#endif
  const std::span<const CompiledKernel> single = compiled_kernels();
  sets.push_back({1, "no vectors", true, {single.begin(), single.end()}});
  return sets;
}

}  // namespace

const std::vector<LaneKernels>& lane_kernels() {
  static const std::vector<LaneKernels> sets = find_lane_kernels();
  return sets;
}

const LaneKernels& chosen_lane_kernels() {
  const char* asked = std::getenv("TRISOUP_LANES");
  std::string widths;
  for (const LaneKernels& set : lane_kernels()) {
    if (!set.usable) continue;
    if (!asked || asked == std::to_string(set.lanes)) return set;
    widths += (widths.empty() ? "" : ", ") + std::to_string(set.lanes);
  }
  throw Error("TRISOUP_LANES={}: this program and CPU have kernels of {} lanes; choose one of these",
              asked ? asked : "", widths);
}

}  // namespace trisoup::gpu::host
