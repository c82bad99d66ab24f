// Arguments of flip_rows.comp.
#ifndef TRISOUP_ARGS_FLIP_ROWS_H
#define TRISOUP_ARGS_FLIP_ROWS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Filters of FLIP along the rows of a band of one view. One workgroup per 64 pixels of a row.
struct FlipRowsArgs {
  POINTER(Floats) colour;  // [height][width][3]
  POINTER(Uints) target;   // [height][width]: RGBA8, alpha is the loss mask
  POINTER(Floats) taps;    // [FLIP_FILTERS][2 radius + 1]
  POINTER(Floats) rows;    // [2][FLIP_FILTERS][row_count][width]: of rendering and photograph
  uint width, first_row, row_count, radius;
};

// Filters: of Y, X - Y, two of Y - Z; for edges and points: smooth, first and second derivative of Y.
#define FLIP_FILTERS 7
#define FLIP_MOST_RADIUS 64

#ifndef GL_core_profile
}
#endif
#endif
