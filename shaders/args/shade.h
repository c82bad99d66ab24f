// Arguments of shade.comp.
#ifndef TRISOUP_ARGS_SHADE_H
#define TRISOUP_ARGS_SHADE_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// The colour of every pixel from features, view direction, MLP and background. Each workgroup processes every
/// groups-th block of 16 x 16 pixels.
struct ShadeArgs {
  POINTER(Views) views;
  POINTER(Hits) hits;
  POINTER(Textures) textures;
  POINTER(Float4s) lattice;  // [lattice samples][8], after the sigmoid
  POINTER(Floats) mlp;       // [MLP_COUNT]
  POINTER(Floats) colour;    // [pixels][3]
  POINTER(Floats) debug;     // [pixels][16]: MLP inputs, if requested
  uint blocks, view_count;
  float background_r, background_g, background_b;
  uint groups;
};

#ifndef GL_core_profile
}
#endif
#endif
