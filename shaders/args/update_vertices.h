// Arguments of update_vertices.comp.
#ifndef TRISOUP_ARGS_UPDATE_VERTICES_H
#define TRISOUP_ARGS_UPDATE_VERTICES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// VectorAdam on every vertex. One thread per triangle.
struct UpdateVerticesArgs {
  POINTER(Floats) vertices;
  POINTER(Floats) moment1;  // [3T][3]
  POINTER(Floats) moment2;  // [3T]
  POINTER(Uints) gradient_low;
  POINTER(Uints) gradient_high;
  POINTER(Steps) state;
  POINTER(Controls) control;
  POINTER(Floats) debug;  // [3T][3]: gradient, if requested
  POINTER(Floats) eyes;   // [eye_count][3]: positions of the training cameras
  uint triangles;
  float full_side;      // triangles smaller than this have learning rates in proportion to their side; 0: none has
  uint eye_count;       // 0: the learning rate does not depend on the distance
  float full_distance;  // vertices nearer than this to an eye have learning rates in proportion to their distance
  float still_beyond;   // vertices farther than this from the origin stay where they are; 0: none
  uint pad;
};

#ifndef GL_core_profile
}
#endif
#endif
