// Arguments of edge_forces.comp.
#ifndef TRISOUP_ARGS_EDGE_FORCES_H
#define TRISOUP_ARGS_EDGE_FORCES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Vertex forces between neighbouring pixels. One workgroup per tile of 8 x 8 pixels.
struct EdgeForcesArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(ScreenTriangles) screen;
  POINTER(Floats) colour;
  POINTER(Float4s) gradient;
  POINTER(Uints) vertex_low;  // [T][3][3], fixed point, normalised coordinates
  POINTER(Uints) vertex_high;
  uint tiles, view_count, triangles, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
