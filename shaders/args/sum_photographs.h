// Arguments of sum_photographs.comp.
#ifndef TRISOUP_ARGS_SUM_PHOTOGRAPHS_H
#define TRISOUP_ARGS_SUM_PHOTOGRAPHS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Colours of the photographs, by the samples of the textures that show them. One workgroup per block of 16 x 16
/// pixels.
struct SumPhotographsArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Textures) textures;  // [T]: lattice_offset counts samples of `low`
  POINTER(Uints)
  low;  // [lattice samples of triangles first .. last - 1][4] fixed point, added to: weight times red, green, blue, 1
  POINTER(Uints) high;
  uint view_count, blocks;
  uint first, last;
  uint stride, pad;  // every stride-th pixel takes part
};

#ifndef GL_core_profile
}
#endif
#endif
