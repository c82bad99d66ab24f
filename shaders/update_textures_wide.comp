// update_textures for large textures on a GPU: shared memory, of which they take up to 25 KB, lets few workgroups stand on a multiprocessor, and those of
// 64 threads would leave most of it idle. The bits are the same.
#define THREADS 256u
#include "update_textures.comp"
