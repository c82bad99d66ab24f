// Sums the workgroups' gradients of every MLP parameter in a fixed order and applies Adam.
#include "common/kernel.h"
#include "args/update_mlp.h"
#include "common/optimiser.h"

CONSTANT(0, bool, DEBUG, false);

KERNEL(64, UpdateMlpArgs) {
  const uint i = thread_index();
  if (i >= 595u) return;
  float gradient = 0.0f;
  for (uint g = 0u; g < a.groups; ++g) gradient += a.mlp_partial.v[g * 595u + i];
  if (DEBUG) a.debug.v[i] = gradient;
  if (a.control.v[0].overflow != 0u) return;
  float m = a.moment1.v[i], v = a.moment2.v[i];
  a.mlp.v[i] -= adam(gradient, a.state.v[0].rate_mlp, a.state.v[0].second_mlp, m, v);
  a.moment1.v[i] = m;
  a.moment2.v[i] = v;
}
