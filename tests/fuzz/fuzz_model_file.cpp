// Fuzzes decode_model of engine/format/model_file.h.
#include <cstddef>
#include <cstdint>

#include "base/error.h"
#include "format/model_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    trisoup::soup::decode_model({reinterpret_cast<const std::byte*>(data), size}, "fuzz");
  } catch (const trisoup::Error&) {
    // Expected for bad input.
  }
  return 0;
}
