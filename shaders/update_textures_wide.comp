// update_textures for large textures on a GPU. They use up to 25 KB of shared memory, so few workgroups fit on a
// multiprocessor; 256 threads per workgroup keep it busy. The results are bit-identical.
#define THREADS 256u
#include "update_textures.comp"
