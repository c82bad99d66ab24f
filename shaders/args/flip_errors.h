// Arguments of flip_errors.comp.
#ifndef TRISOUP_ARGS_FLIP_ERRORS_H
#define TRISOUP_ARGS_FLIP_ERRORS_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Filters of FLIP along the columns and the errors of a band of one view. One workgroup per 64
/// pixels of a row.
struct FlipErrorsArgs {
  POINTER(Uints) target;   // [height][width]: RGBA8, alpha is the loss mask
  POINTER(Floats) taps;    // as in FlipRowsArgs
  POINTER(Floats) rows;    // from flip_rows.comp
  POINTER(Floats) errors;  // [height][width], 0..1; 0 outside the mask
  POINTER(Uints) sums;  // added to: sum of the errors in fixed point, in units of IMAGE_SUM_UNIT; number of pixels; 0
  uint width, height;
  uint first_row, row_count;  // of `rows`
  uint first, last;           // rows of the picture to measure
  uint radius;
  float blue_share;  // of the first filter of Y - Z
  float most;        // largest colour error
  uint pad;
};

#ifndef GL_core_profile
}
#endif
#endif
