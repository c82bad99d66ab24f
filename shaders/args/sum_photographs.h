// Arguments of sum_photographs.comp.
#ifndef TRISOUP_ARGS_SUM_PHOTOGRAPHS_H
#define TRISOUP_ARGS_SUM_PHOTOGRAPHS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums the photographs' colours over the texture samples that show them. One workgroup per block of 16 x 16 pixels.
struct SumPhotographsArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Textures) textures;  // [T]: lattice_offset is an index into `low`
  // [lattice samples of triangles first .. last - 1][4] fixed point, added to: weight times red, green, blue, 1
  POINTER(Uints) low;
  POINTER(Uints) high;
  POINTER(Float4s) exposure;  // [photographs][25]: of the colours; 0 unless exposed
  uint view_count, blocks;
  uint first, last;
  uint stride, exposed;  // every stride-th pixel is used
};

#ifndef GL_core_profile
}
#endif
#endif
