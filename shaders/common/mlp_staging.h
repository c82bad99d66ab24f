// The MLP's parameters in shared memory, because every thread reads all of them. Include before common/shading.h.
#include "common/mlp_layout.h"

SHARED float s_mlp[MLP_COUNT];
#define MLP(i) s_mlp[i]

FN void stage_mlp(Floats mlp, uint thread) {
  for (uint i = thread; i < MLP_COUNT; i += 64u) s_mlp[i] = mlp.v[i];
}
