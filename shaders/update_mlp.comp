// Sums the workgroups' gradients of every MLP parameter in a fixed order and applies Adam.
#include "common/kernel.h"
#include "args/update_mlp.h"
#include "common/faults.h"
#include "common/optimiser.h"

CONSTANT(0, bool, DEBUG, false);

KERNEL(64, UpdateMlpArgs) {
  const uint i = thread_index();
  if (i >= 595u) return;
  float gradient = 0.0f;
  for (uint g = 0u; g < a.groups; ++g) gradient += a.mlp_partial.v[g * 595u + i];
  if (DEBUG) a.debug.v[i] = gradient;
  if (a.control.v[0].overflow != 0u) return;
  float weight = a.mlp.v[i], m = a.moment1.v[i], v = a.moment2.v[i];
  const float before = weight;
  // One weight that is not a number leaves no gradient a number: the others wait a step, until it is reset.
  if (usable(gradient, 1e18f)) weight -= adam(gradient, a.state.v[0].rate_mlp, a.state.v[0].second_mlp, m, v);
  if (!usable(weight, kLargestWeight) || !usable(m, 1e30f) || !usable(v, 1e37f)) {
    weight = usable(before, kLargestWeight) ? before : 0.0f;
    m = v = 0.0f;
    note_fault(a.control, FAULT_WEIGHT, i, a.state.v[0].step);
  }
  a.mlp.v[i] = weight;
  a.moment1.v[i] = m;
  a.moment2.v[i] = v;
}
