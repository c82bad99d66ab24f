// Tests the translator of kernels to lanes (engine/gpu/lanes): compares probe.comp with 4, 8 and 16 lanes with the same
// file compiled as C++.
#include <catch2/catch.hpp>

#include <array>
#include <cstring>
#include <vector>

#include "gpu/compiled_kernels.h"
#include "gpu/host/workgroup.h"
#include "gpu/lanes/lane_kernels.h"
#include "probe_widths.h"

namespace trisoup::gpu::host {
std::span<const CompiledKernel> probes();
#define PROBES(width) std::span<const CompiledKernel> probes_##width();
FOR_WIDTHS(PROBES)
#undef PROBES
}  // namespace trisoup::gpu::host

using namespace trisoup::gpu;
using host::CompiledKernel;

namespace {

// Padding around arrays, because lanes may read beyond the words that they need (lane_memory.h).
constexpr std::size_t kRoom = 64, kCount = 90;

struct Memory {
  std::vector<std::uint32_t> numbers = std::vector<std::uint32_t>(64 + 2 * kRoom),
                             result = std::vector<std::uint32_t>(256 + 2 * kRoom, 77);
  std::vector<float> vectors = std::vector<float>(8 + kCount + 2 * kRoom);
};

Memory after(const CompiledKernel& kernel, std::uint32_t seed) {
  Memory memory;
  std::uint32_t state = seed;
  for (std::size_t i = 0; i < 64; ++i) {
    state = state * 1664525u + 1013904223u;
    memory.numbers[kRoom + i] = (state >> 16) % 1000;
  }
  for (std::size_t i = 0; i < memory.vectors.size(); ++i) memory.vectors[i] = static_cast<float>(i);
  struct {
    std::uint32_t* numbers;
    float* vectors;
    std::uint32_t* result;
    std::uint32_t count, pad;
  } arguments{&memory.numbers[kRoom], &memory.vectors[kRoom], &memory.result[kRoom], kCount, 0};
  REQUIRE(kernel.argument_bytes == sizeof arguments);
  host::Workgroup workgroup;
  workgroup.run(kernel, reinterpret_cast<const std::byte*>(&arguments), 0);
  return memory;
}

bool usable(std::uint32_t lanes) {
  for (const host::LaneKernels& set : host::lane_kernels())
    if (set.lanes == lanes) return set.usable;
  return false;
}

}  // namespace

TEST_CASE("kernels with lanes give the same results as one invocation after another", "[lanes]") {
  std::vector<std::span<const CompiledKernel>> sets;
#define ADD(width) sets.push_back(host::probes_##width());
  FOR_WIDTHS(ADD)
#undef ADD
  for (const auto& set : sets)
    for (const CompiledKernel& lanes : set) {
      if (!usable(lanes.lanes)) continue;
      const std::uint32_t which = lanes.constants.at(0);
      const CompiledKernel& one = host::probes()[which];
      REQUIRE(one.constants.at(0) == which);
      for (std::uint32_t seed : {1u, 2u, 3u, 40u, 500u}) {
        CAPTURE(which, lanes.lanes, seed);
        const Memory expected = after(one, seed), got = after(lanes, seed);
        CHECK(got.result == expected.result);
        CHECK(got.vectors == expected.vectors);
      }
    }
}
