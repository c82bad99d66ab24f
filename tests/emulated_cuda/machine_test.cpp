// Tests machine.h with the kernels in probes.ptx: single instructions must follow NVIDIA's manuals, and all faults must
// be detected.
#include <catch2/catch.hpp>

#include <cstring>
#include <limits>

#include "emulated_cuda/machine.h"

using namespace trisoup::emulated_cuda;
using Catch::Matchers::Contains;

namespace {

struct Buffer {
  std::uint64_t address = machine.allocate(64);
  ~Buffer() { machine.free(address); }
  template <typename T>
  T* as() const {
    return reinterpret_cast<T*>(address);
  }
};

/// Runs a kernel and returns its findings.
std::vector<std::string> findings(const char* kernel, const Buffer& buffer, std::uint32_t groups = 2,
                                  std::uint32_t threads = 64) {
  machine.forget_findings();
  const Kernel* const found = find_kernel(kernel);
  REQUIRE(found);
  machine.run(*found, groups, threads, reinterpret_cast<const std::byte*>(&buffer.address));
  const std::vector<std::string> all = machine.findings();
  CHECK(all.empty() == (machine.fault() == Fault::none));
  machine.forget_findings();
  return all;
}

std::string first(const char* kernel, const Buffer& buffer, std::uint32_t groups = 2, std::uint32_t threads = 64) {
  const std::vector<std::string> all = findings(kernel, buffer, groups, threads);
  return all.empty() ? std::string("nothing") : all[0];
}

std::vector<std::uint32_t> integers(std::uint32_t a, std::uint32_t b) {
  const Buffer buffer{machine.allocate(128)};
  buffer.as<std::uint32_t>()[0] = a, buffer.as<std::uint32_t>()[1] = b;
  CHECK(findings("integers", buffer, 1, 1).empty());
  return {buffer.as<std::uint32_t>() + 4, buffer.as<std::uint32_t>() + 18};
}

struct Floats {
  float min, max, saturated, floor;
  std::int32_t to_signed;
  std::uint32_t to_unsigned, less, not_less, exp2_bits;
  float fma;
  std::uint32_t differ;
};
Floats floats(float a, float b) {
  const Buffer buffer;
  buffer.as<float>()[0] = a, buffer.as<float>()[1] = b;
  CHECK(findings("floats", buffer, 1, 1).empty());
  Floats results;
  std::memcpy(&results, buffer.as<float>() + 4, sizeof results);
  return results;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();

}  // namespace

TEST_CASE("faults of kernels are detected", "[machine]") {
  const Buffer buffer;
  CHECK_THAT(first("outside", buffer), Contains("outside") && Contains("an access outside of every allocation"));
  CHECK_THAT(first("misaligned", buffer), Contains("misaligned"));
  CHECK_THAT(first("unordered", buffer), Contains("what another thread") && Contains("shared memory"));
  CHECK_THAT(first("quarrel", buffer), Contains("writes what another thread writes (device memory)"));
  CHECK_THAT(first("peek", buffer), Contains("what another thread reads (device memory)"));
  CHECK_THAT(first("late", buffer, 1), Contains("reads what another thread writes"));
  CHECK_THAT(first("hasty", buffer, 1), Contains("what another thread writes (shared memory)"));
  CHECK_THAT(first("overrun", buffer), Contains("an access outside of local memory"));
  CHECK_THAT(first("stray", buffer), Contains("some threads of the workgroup reach fewer barriers than others"));
  CHECK_THAT(first("apart", buffer), Contains("waits at this barrier while others"));
}

TEST_CASE("correct kernels give no findings", "[machine]") {
  const Buffer buffer;
  std::memset(buffer.as<char>(), 0, 64);
  CHECK(first("ordered", buffer) == "nothing");
  CHECK(first("mark", buffer) == "nothing");
  CHECK(buffer.as<std::uint32_t>()[0] == 1);
  CHECK(buffer.as<std::uint32_t>()[1] == 128);
  CHECK(first("tally", buffer) == "nothing");
  CHECK(buffer.as<std::uint32_t>()[0] == 3 * 64);
  CHECK(buffer.as<std::uint32_t>()[1] == 63);
  // With one workgroup of one thread there are no conflicts. Launches are ordered.
  for (int i = 0; i < 2; ++i) {
    CHECK(first("quarrel", buffer, 1, 1) == "nothing");
    CHECK(first("peek", buffer, 1, 1) == "nothing");
  }
}

TEST_CASE("accesses to memory that was freed or never allocated are detected", "[machine]") {
  Buffer gone;
  machine.free(gone.address);
  CHECK_THAT(first("mark", gone), Contains("outside of every allocation"));
  CHECK_FALSE(machine.free(gone.address));
  gone.address = 0;
  CHECK_THAT(first("mark", gone), Contains("outside of every allocation"));
  const std::uint64_t before = machine.free_bytes();
  CHECK(machine.allocate(machine.total_bytes() + 1) == 0);
  CHECK(machine.free_bytes() == before);
  const Buffer a, b;
  CHECK(machine.holds(a.address, 64));
  CHECK_FALSE(machine.holds(a.address, 65));
  CHECK(machine.free_bytes() == before - 128);
}

TEST_CASE("integer instructions follow the manual", "[machine]") {
  // shl, shr.u32, shr.s32, min.s32 | min.u32, mul.lo, high half of mul.wide, mad.lo -1 | brev, bfind.shiftamt, bfi 4 8,
  // less | less unsigned, cvt.u16 + 1
  CHECK(integers(0x80000001u, 4) ==
        std::vector<std::uint32_t>{0x10, 0x08000000, 0xf8000000, 0x80000001, 4, 4, 2, 3, 0x80000001, 0, 0x14, 1, 0, 2});
  // Shifts clamp at 32. 16-bit values wrap around.
  CHECK(integers(0x8000ffffu, 40) == std::vector<std::uint32_t>{0, 0, 0xffffffff, 0x8000ffff, 40, 40u * 0x8000ffffu, 20,
                                                                40u * 0x8000ffffu - 1, 0xffff0001, 0, 0xff8, 1, 0, 0});
  CHECK(integers(0, 0xffffffff)[9] == 0xffffffff);  // bfind of zero
}

TEST_CASE("float instructions follow the manual", "[machine]") {
  const Floats usual = floats(-1.5f, 2.0f);
  CHECK(usual.min == -1.5f);
  CHECK(usual.max == 2);
  CHECK(usual.saturated == 0);
  CHECK(usual.floor == -2);
  CHECK(usual.to_signed == -1);
  CHECK(usual.to_unsigned == 0);
  CHECK(usual.less == 1);
  CHECK(usual.not_less == 0);
  CHECK(std::bit_cast<float>(usual.exp2_bits) == Approx(std::exp2(-1.5)));
  CHECK(usual.fma == -2);
  CHECK(usual.differ == 1);
  const Floats nan = floats(kNan, 3.0f);
  CHECK(nan.min == 3);
  CHECK(nan.max == 3);
  CHECK(nan.saturated == 0);
  CHECK(nan.to_signed == 0);
  CHECK(nan.to_unsigned == 0);
  CHECK(nan.less == 0);
  CHECK(nan.not_less == 1);
  CHECK(nan.differ == 1);
  CHECK(floats(kInfinity, 0).to_signed == std::numeric_limits<std::int32_t>::max());
  CHECK(floats(kInfinity, 0).to_unsigned == 0xffffffffu);
  CHECK(floats(-kInfinity, 0).to_signed == std::numeric_limits<std::int32_t>::min());
  CHECK(std::signbit(floats(0.0f, -0.0f).min));
  CHECK_FALSE(std::signbit(floats(-0.0f, 0.0f).max));
  CHECK(floats(-140, 0).exp2_bits == 0);                                             // below the smallest normal number
  CHECK(floats(1 + 0x1p-12f, 1 - 0x1p-12f).fma == static_cast<float>(2 - 0x1p-24));  // rounded once
}

TEST_CASE("instructions, bank conflicts and sectors are counted per warp", "[machine]") {
  const Buffer buffer{machine.allocate(256)};
  machine.enable_counts();
  const auto before = machine.counts().contains("banks") ? machine.counts().at("banks") : Counts{};
  CHECK(first("banks", buffer, 3, 32) == "nothing");
  const Counts counts = machine.counts().at("banks");
  CHECK(counts.launches == before.launches + 1);
  using enum Unit;
  const auto of = [&](Unit unit) {
    return counts.instructions[static_cast<std::size_t>(unit)] - before.instructions[static_cast<std::size_t>(unit)];
  };
  CHECK(of(shared) == 3 * 3);
  CHECK(of(global) == 3);
  CHECK(of(multiply_add) == 0);
  CHECK(of(other) == 3 * (2 + 2 + 1 + 1 + 1));  // shl, add, mul.wide, add.s64, ret
  CHECK(counts.shared_wavefronts - before.shared_wavefronts == 3 * (1 + 1 + 32));
  CHECK(counts.sectors - before.sectors == 3 * 8);
  // Loads of four words by 32 threads. The same address in all threads takes two passes, because quarters of the warp
  // are combined in pairs. Neighbouring addresses take four, because a pass transfers at most 128 bytes. Addresses
  // 1,024 bytes apart use the same banks and take one pass per thread.
  const auto passes = machine.counts().contains("vectors") ? machine.counts().at("vectors").shared_wavefronts : 0;
  CHECK(first("vectors", buffer, 1, 32) == "nothing");
  CHECK(machine.counts().at("vectors").shared_wavefronts - passes == 2 + 4 + 32);
}
