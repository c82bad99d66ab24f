// Tests engine/base/memory.h and engine/scene/load/loading_memory.h: memory of machines and containers.
#include <catch2/catch.hpp>

#include <filesystem>
#include <string>

#include "../temporary_folder.h"
#include "base/memory.h"
#include "scene/load/loading_memory.h"

using namespace trisoup;
using Catch::Contains;

namespace {

constexpr std::uint64_t kMb = 1 << 20;

/// A machine with 8000 MB, of which 6000 MB are available, and the cgroups of this process.
struct FakeMachine {
  explicit FakeMachine(const std::string& cgroups) {
    write("proc/meminfo",
          "MemTotal:        8192000 kB\nMemFree:          100000 kB\nMemAvailable:    6144000 kB\nSwapFree: 1024 kB\n");
    write("proc/self/cgroup", cgroups);
  }
  void write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((folder / name).parent_path());
    folder.file(name, content);
  }
  Memory memory() const { return memory_of_machine(folder.path()); }
  test::TemporaryFolder folder;
};

std::string bytes(std::uint64_t megabytes) { return std::to_string(megabytes * kMb) + "\n"; }

}  // namespace

TEST_CASE("the memory of a machine is what the kernel calls available", "[memory]") {
  const Memory memory = FakeMachine("0::/\n").memory();
  CHECK(memory.total == 8000 * kMb);
  CHECK(memory.available == 6000 * kMb);
  CHECK(memory.swap == kMb);
  CHECK_FALSE(memory.limited);
}

TEST_CASE("limits of cgroups of version 2 apply, also those of the groups above", "[memory]") {
  const FakeMachine machine("0::/user/job/step\n");
  machine.write("sys/fs/cgroup/user/job/step/memory.max", "max\n");
  machine.write("sys/fs/cgroup/user/job/step/memory.current", bytes(10));
  CHECK(machine.memory().available == 6000 * kMb);
  machine.write("sys/fs/cgroup/user/job/memory.max", bytes(2000));
  machine.write("sys/fs/cgroup/user/job/memory.current", bytes(700));
  machine.write("sys/fs/cgroup/user/job/memory.stat", "anon 5\ninactive_file " + bytes(200));
  const Memory memory = machine.memory();
  CHECK(memory.total == 2000 * kMb);
  CHECK(memory.available == 1500 * kMb);
  CHECK(memory.swap == 0);
  CHECK(memory.limited);
  // Used up: nothing is available.
  machine.write("sys/fs/cgroup/user/memory.max", bytes(100));
  machine.write("sys/fs/cgroup/user/memory.current", bytes(150));
  CHECK(machine.memory().available == 0);
}

TEST_CASE("limits of cgroups of version 1 apply, also in a container that sees only its own", "[memory]") {
  const FakeMachine machine("5:cpu:/x\n4:memory:/docker/0123\n1:name=systemd:/docker/0123\n0::/system\n");
  CHECK(machine.memory().available == 6000 * kMb);
  machine.write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");  // no limit
  machine.write("sys/fs/cgroup/memory/memory.usage_in_bytes", bytes(7000));
  CHECK(machine.memory().available == 6000 * kMb);
  CHECK_FALSE(machine.memory().limited);
  machine.write("sys/fs/cgroup/memory/memory.limit_in_bytes", bytes(1000));
  machine.write("sys/fs/cgroup/memory/memory.usage_in_bytes", bytes(400));
  machine.write("sys/fs/cgroup/memory/memory.stat", "inactive_file 1\ntotal_inactive_file " + bytes(100));
  CHECK(machine.memory().total == 1000 * kMb);
  CHECK(machine.memory().available == 700 * kMb);
  CHECK(machine.memory().limited);
}

TEST_CASE("files that cannot be understood give no limit", "[memory]") {
  const FakeMachine machine("nonsense\n0::/../x\n:::\n");
  machine.write("sys/fs/cgroup/memory.max", "what\n");
  CHECK(machine.memory().available == 6000 * kMb);
  const test::TemporaryFolder empty;
  CHECK(memory_of_machine(empty.path()).total > 0);  // from the system call
}

TEST_CASE("photographs that exceed the memory are refused with a resolution that fits", "[memory]") {
  const scene::LoadingNeed need{300, 4000 * kMb, 100 * kMb};
  CHECK_NOTHROW(scene::check_loading_memory(need, 1, {8000 * kMb, 4100 * kMb, 0, false}, "d"));
  CHECK_NOTHROW(scene::check_loading_memory(need, 1, {8000 * kMb, 4099 * kMb, kMb, false}, "d"));
  CHECK_THROWS_WITH(scene::check_loading_memory(need, 1, {8000 * kMb, 4099 * kMb, 0, false}, "d"),
                    "d: 300 photographs need 4100 MB of memory, 4099 MB are available; use `resolution` 2");
  CHECK_THROWS_WITH(scene::check_loading_memory(need, 1.5, {500 * kMb, 400 * kMb, 0, true}, "d"),
                    Contains("within the limit of this container") && Contains("use `resolution` 6"));
  CHECK_THROWS_WITH(scene::check_loading_memory(need, 1, {500 * kMb, 50 * kMb, 0, true}, "d"),
                    Contains("use fewer or smaller photographs"));
}
