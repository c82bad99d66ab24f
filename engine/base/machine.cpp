#include "base/machine.h"

#include <algorithm>
#include <fstream>
#include <thread>

#include <fmt/format.h>

namespace trisoup {
namespace {

/// Returns the value of the first line `key: value` or `key=value` of a file, or an empty string if there is none.
std::string value_in(const char* file, const std::string& key, char between) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const std::size_t at = line.find(between);
    if (line.compare(0, key.size(), key) != 0 || at == std::string::npos) continue;
    std::string value = line.substr(at + 1);
    std::erase(value, '"');
    return value.substr(std::min(value.find_first_not_of(" \t"), value.size()));
  }
  return {};
}

}  // namespace

std::string machine() {
  return fmt::format("{}, {} threads, {}", value_in("/proc/cpuinfo", "model name", ':'),
                     std::thread::hardware_concurrency(), value_in("/etc/os-release", "PRETTY_NAME", '='));
}

}  // namespace trisoup
