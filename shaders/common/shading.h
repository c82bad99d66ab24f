// Neural shading (DiffSoup, section 3): a small MLP maps 7 features and the spherical harmonics of the view direction
// to a colour. The includer defines MLP(i), the i-th parameter (mlp_layout.h).
#include "common/mlp_layout.h"

/// Real spherical harmonics up to degree 2 of the unit vector v from the surface towards the camera.
FN void spherical_harmonics(vec3 v, OUT_ARRAY(y, 9)) {
  y[0] = real(0.28209479);
  y[1] = real(-0.48860251f) * v.y;
  y[2] = real(0.48860251) * v.z;
  y[3] = real(-0.48860251f) * v.x;
  y[4] = real(1.09254843) * v.x * v.y;
  y[5] = real(-1.09254843f) * v.y * v.z;
  y[6] = real(0.31539157) * (real(2) * v.z * v.z - v.x * v.x - v.y * v.y);
  y[7] = real(-1.09254843f) * v.x * v.z;
  y[8] = real(0.54627422) * (v.x * v.x - v.y * v.y);
}

// LANES is the MLP's number type: one number, or several pixels at once. Kernels define it before including this file.
#if defined(GL_core_profile) || defined(TRISOUP_KERNEL_CODE)
#define MLP_PARAMETERS
#else
#define LANES real
#define MLP_PARAMETERS const real *parameters,
#undef MLP
#define MLP(i) parameters[i]
#endif
#define LANES_IN(name, n) IN_ARRAY_OF(LANES, name, n)
#define LANES_OUT(name, n) OUT_ARRAY_OF(LANES, name, n)
FN real one_where_positive(real x) { return x > real(0) ? real(1) : real(0); }
#if defined(GL_core_profile) || defined(TRISOUP_KERNEL_CODE)
FN vec4 one_where_positive(vec4 x) { return vec4(greaterThan(x, vec4(0.0f))); }
#endif

/// x[16] -> hidden activations h1[16], h2[16] (after ReLU) and the colour y[3] in (0, 1).
FN void mlp_forward(MLP_PARAMETERS LANES_IN(x, 16), LANES_OUT(h1, 16), LANES_OUT(h2, 16), LANES_OUT(y, 3)) {
  UNROLL for (int o = 0; o < 16; ++o) {
    LANES sum = LANES(MLP(MLP_B1 + o));
    UNROLL for (int i = 0; i < 16; ++i) sum += MLP(o * 16 + i) * x[i];
    h1[o] = max(sum, LANES(0));
  }
  UNROLL for (int o = 0; o < 16; ++o) {
    LANES sum = LANES(MLP(MLP_B2 + o));
    UNROLL for (int i = 0; i < 16; ++i) sum += MLP(MLP_W2 + o * 16 + i) * h1[i];
    h2[o] = max(sum, LANES(0));
  }
  UNROLL for (int o = 0; o < 3; ++o) {
    LANES sum = LANES(MLP(MLP_B3 + o));
    UNROLL for (int i = 0; i < 16; ++i) sum += MLP(MLP_W3 + o * 16 + i) * h2[i];
    y[o] = LANES(1) / (LANES(1) + exp(-sum));
  }
}

/// Computes from dL/dy[3] the gradients before each activation, d1[16], d2[16], d3[3], and dL/dx of the first 7 inputs.
/// The gradient of a weight is d[out] times the layer's input; that of a bias is d[out].
FN void mlp_backward(MLP_PARAMETERS LANES_IN(h1, 16), LANES_IN(h2, 16), LANES_IN(y, 3), LANES_IN(dy, 3),
                     LANES_OUT(d1, 16), LANES_OUT(d2, 16), LANES_OUT(d3, 3), LANES_OUT(dx, 7)) {
  UNROLL for (int o = 0; o < 3; ++o) d3[o] = dy[o] * y[o] * (LANES(1) - y[o]);
  // Row by row, in memory order of the weights, so that the compiler can vectorise.
  LANES g[16];
  UNROLL for (int i = 0; i < 16; ++i) g[i] = LANES(0);
  UNROLL for (int o = 0; o < 3; ++o) UNROLL for (int i = 0; i < 16; ++i) g[i] += MLP(MLP_W3 + o * 16 + i) * d3[o];
  UNROLL for (int i = 0; i < 16; ++i) {
    d2[i] = g[i] * one_where_positive(h2[i]);
    g[i] = LANES(0);
  }
  UNROLL for (int o = 0; o < 16; ++o) UNROLL for (int i = 0; i < 16; ++i) g[i] += MLP(MLP_W2 + o * 16 + i) * d2[o];
  UNROLL for (int i = 0; i < 16; ++i) d1[i] = g[i] * one_where_positive(h1[i]);
  UNROLL for (int i = 0; i < 7; ++i) dx[i] = LANES(0);
  UNROLL for (int o = 0; o < 16; ++o) UNROLL for (int i = 0; i < 7; ++i) dx[i] += MLP(o * 16 + i) * d1[o];
}

/// Features 0..2 are the base colour; feature 3 is the weight of the MLP's colour.
FN vec3 skip_connection(IN_ARRAY(f, 7), vec3 y) { return (real(1) - f[3]) * vec3(f[0], f[1], f[2]) + f[3] * y; }

/// dL/dcolour -> dL/dy and the part of dL/df that does not pass through the MLP.
FN void skip_connection_backward(IN_ARRAY(f, 7), vec3 y, vec3 dc, OUT(vec3) dy, OUT(vec3) drgb, OUT(real) dmix) {
  dy = f[3] * dc;
  drgb = (real(1) - f[3]) * dc;
  dmix = dot(dc, y - vec3(f[0], f[1], f[2]));
}
