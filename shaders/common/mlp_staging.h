// The MLP's parameters in shared memory, because every thread reads all of them. Include before common/shading.h.
SHARED float s_mlp[595];
#define MLP(i) s_mlp[i]

FN void stage_mlp(Floats mlp, uint thread) {
  for (uint i = thread; i < 595u; i += 64u) s_mlp[i] = mlp.v[i];
}
