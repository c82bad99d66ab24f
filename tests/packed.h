// Bytes of binary files that tests make up.
#pragma once

#include <string>

namespace trisoup::test {

/// The values' bytes one after the other, as this machine has them in memory.
template <typename... Values>
std::string pack(Values... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

}  // namespace trisoup::test
