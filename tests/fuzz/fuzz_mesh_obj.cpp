// Fuzzes read_obj: any bytes must give a mesh or an Error.
#include "base/error.h"
#include "mesh/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    trisoup::soup::read_obj(std::as_bytes(std::span(data, size)), "fuzz.obj");
  } catch (const trisoup::Error&) {
  }
  return 0;
}
