// Arguments of patch_match_start.comp, patch_match.comp and patch_match_agree.comp.
#ifndef TRISOUP_ARGS_PATCH_MATCH_H
#define TRISOUP_ARGS_PATCH_MATCH_H
#include "args/types.h"

#ifdef GL_core_profile
#define STRUCT struct
#else
#define STRUCT struct alignas(16)
namespace KERNEL_TYPES {
#endif

/// A view and one of its neighbours. to_: rows of the map from (x, y, 1, inverse depth), with (x, y) a pixel centre of
/// the view, to the homogeneous pixel in the neighbour; from_: rows of the way back. Pixel (i, j) has its centre at (i,
/// j), unlike elsewhere.
STRUCT StereoPair {
  vec4 to_x, to_y, to_z;
  vec4 from_x, from_y, from_z;
  uint width, height;  // of the neighbour
  uint pixel_offset;   // index of its first pixel
  uint pad0;
};

#if defined(GL_core_profile) || defined(TRISOUP_KERNEL_CODE)
POINTER_TYPE(StereoPairs, StereoPair, 16)
#endif
#ifndef GL_core_profile
static_assert(sizeof(StereoPair) == 112);
#endif

/// Finds a plane for each pixel of one view (common/patch_match.h). Planes: inverse depth, its change per pixel along x
/// and y, cost.
struct PatchMatchArgs {
  POINTER(Uints)
  greys;                    // [pixels of all views]: grey from 1 to 255 of the pixel, the one to the right, the one
                            // below and the one below that to the right, lowest byte first; 0: masked
  POINTER(Float4s) planes;  // [pixels of all views]
  POINTER(Float4s) before;  // patch_match_start: planes of the coarser level; else all planes as they were before
  POINTER(StereoPairs) pairs;
  POINTER(Uints) agreeing;  // patch_match_agree: [pixels of all views], bit k: neighbour k has the same point
  uint first_pair, pair_count;
  uint width, height, pixel_offset;
  uint coarse_width, coarse_height, coarse_offset;  // patch_match_start; width 0: there is no coarser level
  uint key;                                         // of the random numbers
  uint colour;                                      // patch_match: which half of a checkerboard of pixels
  uint all_neighbours;  // patch_match: 1: all neighbours look at every plane, else those that match best
  float nearest;        // largest inverse depth; the smallest is 0
  float pixel_step;     // change of inverse depth that moves a point by about a pixel in a neighbour
  float change;         // patch_match: largest random change, in pixels in a neighbour
  float geometric;      // patch_match: cost per pixel of disagreement with the neighbours' planes; 0: none
  float largest_cost;   // patch_match_agree: of planes that count
};

#ifndef GL_core_profile
}
#endif
#undef STRUCT
#endif
