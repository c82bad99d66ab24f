// update_textures for large textures on a GPU. They use up to 25 KB of shared memory, so few workgroups fit on a
// multiprocessor; 256 threads each keep it busy. Results are the same, bit for bit.
#define THREADS 256u
#include "update_textures.comp"
