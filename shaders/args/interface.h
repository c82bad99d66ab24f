// Arguments of interface.vert, compare.frag and tint.frag.
#ifndef TRISOUP_ARGS_INTERFACE_H
#define TRISOUP_ARGS_INTERFACE_H
#ifndef GL_core_profile
#include "args/types.h"
namespace KERNEL_TYPES {
#endif

/// Transform from the window library's units to NDC for the viewer's panels.
struct InterfaceArgs {
  float scale_x, scale_y, offset_x, offset_y;
};

/// Comparison of rendering and photograph.
struct CompareArgs {
  float width, height;  // pixels of the picture
  float split;          // the photograph is shown left of this fraction of the width
  uint error;           // 1: show four times the absolute difference instead
};

/// Colour over marked triangles.
struct TintArgs {
  float width, height;            // pixels of the picture
  float red, green, blue, alpha;  // 0..1
};

#ifndef GL_core_profile
}
#endif
#endif
