// Fuzzes engine/format/model_file.cpp.
#include <cstddef>
#include <cstdint>

#include "base/error.h"
#include "format/model_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    trisoup::soup::decode_model({reinterpret_cast<const std::byte*>(data), size}, "fuzz");
  } catch (const trisoup::Error&) {
    // The answer to bad input.
  }
  return 0;
}
