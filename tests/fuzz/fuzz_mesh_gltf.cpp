// Fuzzes read_gltf: any bytes must give a mesh or an Error. The folder does not exist, so no other file is read.
#include "base/error.h"
#include "mesh/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    trisoup::soup::read_gltf(std::as_bytes(std::span(data, size)), "/nonexistent", "fuzz.gltf");
  } catch (const trisoup::Error&) {
  }
  return 0;
}
