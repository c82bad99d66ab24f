// Arguments of project.comp.
#ifndef TRISOUP_ARGS_PROJECT_H
#define TRISOUP_ARGS_PROJECT_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Clip coordinates and pixel box of every triangle in every view. One thread per (view, triangle).
struct ProjectArgs {
  POINTER(Floats) vertices;  // [T][3][3], normalised coordinates
  POINTER(Views) views;
  POINTER(ScreenTriangles) screen;  // [views][T]
  uint triangles, view_count;
  uint drop_near, pad;  // 1: as published, triangles that reach the camera plane are discarded
};

#ifndef GL_core_profile
}
#endif
#endif
