// Arguments of quantise.comp.
#ifndef TRISOUP_ARGS_QUANTISE_H
#define TRISOUP_ARGS_QUANTISE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Quantises lattice samples to 8 bits, as stored in a model. One thread per sample.
struct QuantiseArgs {
  POINTER(Float4s) lattice;  // [samples][8], 0..1
  POINTER(Uints) packed;     // [samples][8 bytes]
  uint samples, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
