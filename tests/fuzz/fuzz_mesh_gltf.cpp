// read_gltf must end with a mesh or an Error, whatever the bytes. The folder does not exist: no file is read.
#include "base/error.h"
#include "mesh/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  try {
    trisoup::soup::read_gltf(std::as_bytes(std::span(data, size)), "/nonexistent", "fuzz.gltf");
  } catch (const trisoup::Error&) {
  }
  return 0;
}
