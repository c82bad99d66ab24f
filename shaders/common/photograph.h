// Pixels of photographs: RGBA, 8 bits each, red in the lowest.

/// Whether a pixel counts in losses and metrics: its alpha is 128 or more. The others are masked out.
FN bool in_mask(uint rgba) { return rgba >= 0x80000000u; }
