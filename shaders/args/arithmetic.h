// Arguments of arithmetic.comp.
#ifndef TRISOUP_ARGS_ARITHMETIC_H
#define TRISOUP_ARGS_ARITHMETIC_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// 64 operations per round and thread.
struct ArithmeticArgs {
  POINTER(Floats) result;  // [threads]
  uint rounds;
  float factor, summand;
  uint pad;
};

#ifndef GL_core_profile
}
#endif
#endif
