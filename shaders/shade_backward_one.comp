// Backward pass of the shading, one pixel per thread at a time: see common/pixel_lanes.h.
#define PIXELS 1
#include "shade_backward.comp"
