// Arguments of fetch_features.comp.
#ifndef TRISOUP_ARGS_FETCH_FEATURES_H
#define TRISOUP_ARGS_FETCH_FEATURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Features of the visible fragments that are of triangles first .. last - 1. One thread per pixel.
struct FetchFeaturesArgs {
  POINTER(Hits) hits;
  POINTER(Textures) textures;
  POINTER(Float4s) lattice;
  POINTER(Float4s) features;  // [pixels][2]: seven and a 0; those of other pixels stay
  uint pixels, first, last;
  uint coarser;  // 1: of textures without their finest level
};

#ifndef GL_core_profile
}
#endif
#endif
