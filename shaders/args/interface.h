// Arguments of interface.vert and compare.frag.
#ifndef TRISOUP_ARGS_INTERFACE_H
#define TRISOUP_ARGS_INTERFACE_H
#ifndef GL_core_profile
#include "args/types.h"
namespace KERNEL_TYPES {
#endif

/// Panels: from the window library's units to NDC.
struct InterfaceArgs {
  float scale_x, scale_y, offset_x, offset_y;
};

/// Rendering against photograph.
struct CompareArgs {
  float width, height;  // pixels of the picture
  float split;          // the photograph is left of this share of the width
  uint error;           // 1: the absolute difference, times four, instead
};

#ifndef GL_core_profile
}
#endif
#endif
