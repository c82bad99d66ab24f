// Arguments of measure_motion.comp.
#ifndef TRISOUP_ARGS_MEASURE_MOTION_H
#define TRISOUP_ARGS_MEASURE_MOTION_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Normal equations of the motion of each camera of a batch. Each workgroup processes every groups-th block of 16 x 16
/// pixels.
struct MeasureMotionArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Floats) vertices;  // [T][3][3]
  POINTER(Floats) colour;    // as the photograph's exposure shows it
  POINTER(Uints) target;     // [pixels]: RGBA8, alpha is the loss mask
  POINTER(Controls) control;
  POINTER(Uints) sums_low;  // [photographs][8][4], fixed point: sums of common/camera_motion.h
  POINTER(Uints) sums_high;
  uint blocks, view_count, groups, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
