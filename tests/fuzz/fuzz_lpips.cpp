// Fuzzes read_lpips: the bytes of any file must give a network or an Error.
#include "base/error.h"
#include "train/quality/lpips.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    trisoup::train::parse_lpips(std::as_bytes(std::span(data, size)), "fuzz");
  } catch (const trisoup::Error&) {
  }
  return 0;
}
