// Helpers for fuzz targets of readers: a reader must return, or throw Error with a single line that contains a
// semicolon.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>

#include "base/error.h"

namespace trisoup::fuzz {

template <typename Read>
int expect_result_or_error(Read&& read) {
  try {
    read();
  } catch (const Error& error) {
    if (std::strchr(error.what(), '\n') != nullptr || std::strchr(error.what(), ';') == nullptr) std::abort();
  }
  return 0;
}

inline std::span<const std::byte> bytes(const std::uint8_t* data, std::size_t size) {
  return std::as_bytes(std::span(data, size));
}

}  // namespace trisoup::fuzz
