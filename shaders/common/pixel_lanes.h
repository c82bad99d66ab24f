// Number of pixels a thread shades at a time. With four, each weight is read once for four pixels, which is faster on a
// CPU. GPUs have too few registers for it and use PIXELS 1 (shade_one.comp, shade_backward_one.comp). The results are
// bit-identical.
#ifndef PIXELS
#define PIXELS 4
#endif
#if PIXELS == 1
#define LANES float
#define LANE(v, k) v
// Compilers keep values read from shared memory in registers, but 595 weights do not fit. After a barrier they are read
// again.
#define FORGET_WEIGHTS() barrier()
#else
#define LANES vec4
#define LANE(v, k) v[k]
#define FORGET_WEIGHTS()
#endif
