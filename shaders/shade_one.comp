// Colour of every pixel, one pixel per thread at a time: see common/pixel_lanes.h.
#define PIXELS 1
#include "shade.comp"
