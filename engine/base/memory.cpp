#include "base/memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

namespace trisoup {
namespace {

namespace fs = std::filesystem;

/// Returns the number with which a file begins, or nothing. "max" is no number: version 2 writes it for no limit.
std::optional<std::uint64_t> number_in(const fs::path& file) {
  std::ifstream in(file);
  std::uint64_t value = 0;
  return in >> value ? std::optional(value) : std::nullopt;
}

/// Returns the number after `key` in a file of lines "key number" or "key: number kB".
std::optional<std::uint64_t> number_after(const fs::path& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    std::uint64_t value = 0;
    if (words >> word && word == key && words >> value) return value;
  }
  return std::nullopt;
}

/// Names of the files that a version of cgroups uses.
struct CgroupFiles {
  const char *limit, *used, *cache;
};
constexpr CgroupFiles kVersion1Files{"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"};
constexpr CgroupFiles kVersion2Files{"memory.max", "memory.current", "inactive_file"};

/// Lowers `memory` to the limits in one cgroup's folder.
void apply_cgroup(const fs::path& folder, const CgroupFiles& files, Memory& memory) {
  const auto limit = number_in(folder / files.limit);
  if (!limit) return;  // version 1 writes a number above any memory for no limit
  const std::uint64_t used = number_in(folder / files.used).value_or(0);
  const std::uint64_t cache = std::min(used, number_after(folder / "memory.stat", files.cache).value_or(0));
  const std::uint64_t left = *limit - std::min(*limit, used - cache);
  memory.total = std::min(memory.total, *limit);
  if (left >= memory.available) return;
  memory.available = left;
  memory.limited = true;
}

/// Applies the limits of a cgroup and of those above it. A container often sees only its own cgroup, at the mount
/// point, while /proc/self/cgroup shows the path on the host; folders that do not exist have no limit.
void apply_cgroups(const fs::path& mount, const std::string& path, const CgroupFiles& files, Memory& memory) {
  fs::path folder = mount;
  apply_cgroup(folder, files, memory);
  for (const fs::path& part : fs::path(path).relative_path()) {
    if (part == "..") return;
    folder /= part;
    apply_cgroup(folder, files, memory);
  }
}

}  // namespace

Memory memory_of_machine(const fs::path& root) {
  Memory memory;
  const fs::path proc = root / "proc";
  const auto page = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const auto kilobytes = [&](const char* key) { return number_after(proc / "meminfo", key); };
  const auto total = kilobytes("MemTotal:"), available = kilobytes("MemAvailable:");
  memory.total = total ? *total * 1024 : page * static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES));
  memory.available = available ? *available * 1024 : page * static_cast<std::uint64_t>(sysconf(_SC_AVPHYS_PAGES));
  std::ifstream lines(proc / "self/cgroup");
  for (std::string line; std::getline(lines, line);) {
    // number:controllers:path. Version 2 has no controllers.
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",",
                      path = line.substr(second + 1);
    if (controllers == ",,")
      apply_cgroups(root / "sys/fs/cgroup", path, kVersion2Files, memory);
    else if (controllers.find(",memory,") != std::string::npos)
      apply_cgroups(root / "sys/fs/cgroup/memory", path, kVersion1Files, memory);
  }
  memory.available = std::min(memory.available, memory.total);
  if (!memory.limited) memory.swap = kilobytes("SwapFree:").value_or(0) * 1024;
  return memory;
}

}  // namespace trisoup
