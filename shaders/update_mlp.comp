// Sums the workgroups' gradients of every MLP parameter in a fixed order and applies Adam.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/update_mlp.h"
#include "common/optimiser.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool DEBUG = false;
layout(push_constant) uniform Push { UpdateMlpArgs a; };

void main() {
  const uint i = thread_index();
  if (i >= 595u) return;
  float gradient = 0.0;
  for (uint g = 0u; g < a.groups; ++g) gradient += a.mlp_partial.v[g * 595u + i];
  if (DEBUG) a.debug.v[i] = gradient;
  if (a.control.v[0].overflow != 0u) return;
  float m = a.moment1.v[i], v = a.moment2.v[i];
  a.mlp.v[i] -= adam(gradient, a.state.v[0].rate_mlp, a.state.v[0].second_mlp, m, v);
  a.moment1.v[i] = m;
  a.moment2.v[i] = v;
}
