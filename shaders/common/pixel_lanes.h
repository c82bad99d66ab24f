// How many pixels a thread shades at a time. Four read a weight once for all of them, which a CPU wants; a GPU has not
// the registers for it and runs PIXELS 1 (shade_one.comp, shade_backward_one.comp). The bits are the same.
#ifndef PIXELS
#define PIXELS 4
#endif
#if PIXELS == 1
#define LANES float
#define LANE(v, k) v
// Compilers keep in registers what they have read from shared memory, and 595 weights do not fit; behind a barrier they
// read again.
#define FORGET_WEIGHTS() barrier()
#else
#define LANES vec4
#define LANE(v, k) v[k]
#define FORGET_WEIGHTS()
#endif
