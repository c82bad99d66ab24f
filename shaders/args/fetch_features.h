// Arguments of fetch_features.comp.
#ifndef TRISOUP_ARGS_FETCH_FEATURES_H
#define TRISOUP_ARGS_FETCH_FEATURES_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Fetches the features of visible fragments of triangles first .. last - 1. One thread per pixel.
struct FetchFeaturesArgs {
  POINTER(Hits) hits;
  POINTER(Textures) textures;
  POINTER(Float4s) lattice;
  POINTER(Float4s) features;  // [pixels][2]: seven features and a 0; other pixels are not written
  uint pixels, first, last;
  uint coarser;  // 1: textures without their finest level
};

#ifndef GL_core_profile
}
#endif
#endif
