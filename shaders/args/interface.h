// Arguments of interface.vert and composite.frag.
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

/// The window's picture of a rendering and a photograph.
struct CompositeArgs {
  float width, height;  // pixels of the picture
  float split;          // the photograph is left of this share of the width
  uint error;           // 1: the absolute difference, times four, instead
  uint enlarge;         // 1: the rendering has fewer pixels than the picture
};

#ifndef GL_core_profile
}
#endif
#endif
