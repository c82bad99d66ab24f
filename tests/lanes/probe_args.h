// Arguments of probe.comp.
#ifndef TRISOUP_TESTS_PROBE_ARGS_H
#define TRISOUP_TESTS_PROBE_ARGS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// numbers: [64], any values; vectors: [count] words, stored as vectors; result: [64][4].
struct ProbeArgs {
  POINTER(Uints) numbers;
  POINTER(Float4s) vectors;
  POINTER(Uints) result;
  uint count, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
