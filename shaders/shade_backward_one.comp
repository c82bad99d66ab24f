// Backward through the shading, one pixel of a thread after the other: see common/pixel_lanes.h.
#define PIXELS 1
#include "shade_backward.comp"
