// Fuzzes engine/format/plain_colours.h, which calls decode_model of engine/format/model_file.h.
#include <cstddef>
#include <cstdint>

#include "base/error.h"
#include "format/plain_colours.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    trisoup::soup::read_plain_colours({reinterpret_cast<const std::byte*>(data), size}, "fuzz");
  } catch (const trisoup::Error&) {
    // Expected for bad input.
  }
  return 0;
}
