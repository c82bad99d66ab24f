// Memory that this process may use: that of the machine, or less in a container.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trisoup {

struct Memory {
  std::uint64_t total = 0;      // bytes: of the machine, or the limit of the process's cgroups if that is lower
  std::uint64_t available = 0;  // bytes that can still be allocated; at most total
  std::uint64_t swap = 0;       // bytes of free swap space; 0 if `available` follows from the limit of a cgroup
  bool limited = false;         // whether `available` follows from the limit of a cgroup, as in containers
};

/// Reads /proc/meminfo and the limits of the process's cgroup and all cgroups above it, versions 1 and 2. Memory of
/// caches that the kernel gives back counts as available. Files that do not exist or cannot be understood are ignored.
/// root: the folder that contains proc and sys, for tests.
/// Sources: man 5 proc; the kernel's admin-guide/cgroup-v2.rst and cgroup-v1/memory.rst.
Memory memory_of_machine(const std::filesystem::path& root = "/");

}  // namespace trisoup
