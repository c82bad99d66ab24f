// Tests tools/bench_kernels.h.
#include <catch2/catch.hpp>

#include "bench_kernels.h"

using namespace trisoup;

TEST_CASE("threads, workgroups and shared memory limit the workgroups that fit", "[bench]") {
  CHECK(bench::groups_by_shared_memory(64, 64, 0) == 32);
  CHECK(bench::groups_by_shared_memory(64, 256, 0) == 8);
  CHECK(bench::groups_by_shared_memory(64, 32, 0) == 32);
  CHECK(bench::groups_by_shared_memory(64, 64, 2048) == 32);
  CHECK(bench::groups_by_shared_memory(64, 64, 2049) == 31);
  CHECK(bench::groups_by_shared_memory(64, 64, 65536) == 1);
  CHECK(bench::groups_by_shared_memory(64, 64, 65537) == 0);
  // With 1 KB more for each workgroup.
  CHECK(bench::groups_by_shared_memory(100, 64, 24 << 10) == 4);
  CHECK(bench::groups_by_shared_memory(100, 64, (24 << 10) + 1) == 3);
  CHECK(bench::groups_by_shared_memory(228, 64, 56 << 10) == 4);
}
