// Fuzzes parse_safetensors_header: any bytes must give a valid header or an Error. The first byte is the size of the
// data part.
#include <cstdlib>

#include "base/error.h"
#include "format/safetensors.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  if (size == 0) return 0;
  try {
    const auto header = trisoup::soup::parse_safetensors_header(std::as_bytes(std::span(data + 1, size - 1)), data[0],
                                                                "fuzz.safetensors");
    for (const auto& [name, tensor] : header.tensors)
      if (tensor.begin > tensor.end || tensor.end > data[0]) std::abort();
  } catch (const trisoup::Error&) {
  }
  return 0;
}
