// Fuzzes read_ply: any bytes must give a mesh or an Error.
#include "base/error.h"
#include "mesh/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    trisoup::soup::read_ply(std::as_bytes(std::span(data, size)), "fuzz.ply");
  } catch (const trisoup::Error&) {
  }
  return 0;
}
