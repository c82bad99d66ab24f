// Colour of every pixel, one pixel of a thread after the other: see common/pixel_lanes.h.
#define PIXELS 1
#include "shade.comp"
