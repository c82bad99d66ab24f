// Sums the workgroups' gradients of every MLP parameter in a fixed order and applies Adam.
#include "common/kernel.h"
#include "args/update_mlp.h"
#include "common/mlp_layout.h"
#include "common/non_finite.h"
#include "common/optimiser.h"

CONSTANT(0, bool, DEBUG, false);

SHARED float s_sum[64];

KERNEL(64, UpdateMlpArgs) {
  // Eight threads share the rows of a parameter, because a thousand rows in one thread would be a long dependency chain
  // on a GPU. Eight adjacent parameters form one memory sector.
  const uint thread = gl_LocalInvocationIndex, i = group_index() * 8u + thread % 8u;
  float gradient = 0.0f;
  if (i < MLP_COUNT)
    for (uint g = thread / 8u; g < a.groups; g += 8u) gradient += a.mlp_partial.v[g * MLP_COUNT + i];
  s_sum[thread] = gradient;
  barrier();
  if (thread >= 8u || i >= MLP_COUNT) return;
  for (uint k = 1u; k < 8u; ++k) gradient += s_sum[8u * k + thread];
  if (DEBUG) a.debug.v[i] = gradient;
  if (a.control.v[0].overflow != 0u) return;
  float weight = a.mlp.v[i], m = a.moment1.v[i], v = a.moment2.v[i];
  const float before = weight;
  // One non-finite weight makes all gradients non-finite. The other weights are not updated until it has been reset.
  if (usable(gradient, 1e18f)) weight -= adam(gradient, a.state.v[0].lr_mlp, a.state.v[0].second_mlp, m, v);
  if (!usable(weight, kLargestWeight) || !usable(m, 1e30f) || !usable(v, 1e37f)) {
    weight = usable(before, kLargestWeight) ? before : 0.0f;
    m = v = 0.0f;
    note_non_finite(a.control, NON_FINITE_WEIGHT, i, a.state.v[0].step);
  }
  a.mlp.v[i] = weight;
  a.moment1.v[i] = m;
  a.moment2.v[i] = v;
}
