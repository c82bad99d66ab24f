// dL/dW of the MLP: sums of outer products of a layer's inputs and deltas over the pixels of a workgroup, one pixel per
// thread, which PUT_PIXEL stores in shared memory. All variants add a weight's terms pixel by pixel, so the results are
// bit-identical. Needs shading.h.
#ifdef LANES_OF_A_CPU
// Each lane handles one input and four outputs of each layer. Lanes read adjacent inputs and share the deltas.
SHARED vec4 s_input[64 * 12];       // [pixel]: x, h1, h2
const uint kDeltas = 10u;           // d1, d2 and d3 of a pixel, padded to whole vectors of lanes
SHARED vec4 s_delta[64 * kDeltas];  // [pixel]

struct MlpSums {
  vec4 w1, w2, w3;  // component i: output 4 (thread / 16) + i of layers 1 and 2, output i of layer 3
  float bias;       // output `thread` of the 35 outputs of all layers
};

FN void clear_sums(OUT(MlpSums) sums) {
  sums.w1 = sums.w2 = sums.w3 = vec4(0.0f);
  sums.bias = 0.0f;
}

#define PUT_VECTORS(array, first, v, k)                      \
  UNROLL for (uint i = 0u; i < 4u; ++i) array[(first) + i] = \
      vec4(LANE(v[4u * i], k), LANE(v[4u * i + 1u], k), LANE(v[4u * i + 2u], k), LANE(v[4u * i + 3u], k))
#define PUT_PIXEL(x, h1, h2, d1, d2, d3, k)          \
  PUT_VECTORS(s_input, thread * 12u, x, k);          \
  PUT_VECTORS(s_input, thread * 12u + 4u, h1, k);    \
  PUT_VECTORS(s_input, thread * 12u + 8u, h2, k);    \
  PUT_VECTORS(s_delta, thread* kDeltas, d1, k);      \
  PUT_VECTORS(s_delta, thread* kDeltas + 4u, d2, k); \
  s_delta[thread * kDeltas + 8u] = vec4(LANE(d3[0], k), LANE(d3[1], k), LANE(d3[2], k), 0.0f)

FN void add_pixels(uint thread, INOUT(MlpSums) sums) {
  const uint vector = (thread & 15u) >> 2, component = thread & 3u, part = thread >> 4;
  MlpSums s = sums;
  for (uint q = 0u; q < 64u; ++q) {
    const uint at = q * 12u, delta = q * kDeltas + part;
    s.w1 += s_input[at + vector][component] * s_delta[delta];
    s.w2 += s_input[at + 4u + vector][component] * s_delta[delta + 4u];
  }
  // Local copies, so that the compiler need not mask inactive lanes in every sum.
  if (part == 0u) {
    vec4 w3 = s.w3;
    for (uint q = 0u; q < 64u; ++q) w3 += s_input[q * 12u + 8u + vector][component] * s_delta[q * kDeltas + 8u];
    s.w3 = w3;
  }
  if (thread < 4u * kDeltas) {
    float bias = s.bias;
    for (uint q = 0u; q < 64u; ++q) bias += s_delta[q * kDeltas + (thread >> 2)][thread & 3u];
    s.bias = bias;
  }
  sums = s;
}

/// partial: [MLP_COUNT], starting at `base`.
FN void write_sums(Floats partial, uint base, uint thread, IN(MlpSums) sums) {
  const uint in_index = thread & 15u, output0 = (thread >> 4) * 4u;
  UNROLL for (uint i = 0u; i < 4u; ++i) {
    partial.v[base + (output0 + i) * 16u + in_index] = sums.w1[i];
    partial.v[base + MLP_W2 + (output0 + i) * 16u + in_index] = sums.w2[i];
  }
  if (thread < 35u)
    partial.v[base + (thread < 16u   ? MLP_B1 + thread
                      : thread < 32u ? MLP_B2 + thread - 16u
                                     : MLP_B3 + thread - 32u)] = sums.bias;
  if (output0 != 0u) return;
  UNROLL for (uint i = 0u; i < 3u; ++i) partial.v[base + MLP_W3 + i * 16u + in_index] = sums.w3[i];
}
#else
// Threads 0..35 have a 4 x 4 block of a weight matrix each: 16 of w1, 16 of w2, 4 of w3. Rows of 64 pixels: inputs x,
// h1, h2 (4 rows each), then deltas d1, d2 (4 rows each) and d3 (1 row). A gap after each row places the same pixel of
// the four rows that neighbouring threads read in different banks of shared memory.
const uint kRow = 65u;
SHARED vec4 s_row[21 * kRow];
const uint kD1 = 12u, kD2 = 16u, kD3 = 20u;

struct MlpSums {
  mat4 weights;  // column: output
  vec4 biases;
};

FN void clear_sums(OUT(MlpSums) sums) {
  sums.weights = mat4(0.0f);
  sums.biases = vec4(0.0f);
}

// Stores pixel k of v[16] as four vectors at the thread's position in rows row .. row + 3.
#define PUT(row, v, k)                                                     \
  UNROLL for (uint i = 0u; i < 4u; ++i) s_row[(row + i) * kRow + thread] = \
      vec4(LANE(v[4u * i], k), LANE(v[4u * i + 1u], k), LANE(v[4u * i + 2u], k), LANE(v[4u * i + 3u], k))
/// Stores the MLP's inputs and deltas of the thread's pixel k.
#define PUT_PIXEL(x, h1, h2, d1, d2, d3, k) \
  PUT(0u, x, k);                            \
  PUT(4u, h1, k);                           \
  PUT(8u, h2, k);                           \
  PUT(kD1, d1, k);                          \
  PUT(kD2, d2, k);                          \
  s_row[kD3 * kRow + thread] = vec4(LANE(d3[0], k), LANE(d3[1], k), LANE(d3[2], k), 0.0f)

FN void add_pixels(uint thread, INOUT(MlpSums) sums) {
  if (thread >= 36u) return;
  const uint layer = thread < 16u ? 0u : thread < 32u ? 1u : 2u;
  const uint out_block = layer == 2u ? 0u : (thread >> 2) & 3u;
  const uint delta_row = ((layer == 0u ? kD1 : layer == 1u ? kD2 : kD3) + out_block) * kRow;
  const uint input_row = (layer * 4u + (thread & 3u)) * kRow;
  for (uint q = 0u; q < 64u; ++q) {
    const vec4 delta = s_row[delta_row + q];
    sums.weights += outerProduct(s_row[input_row + q], delta);
    sums.biases += delta;
  }
}

/// partial: [MLP_COUNT], starting at `at`.
FN void write_sums(Floats partial, uint at, uint thread, IN(MlpSums) sums) {
  if (thread >= 36u) return;
  const uint layer = thread < 16u ? 0u : thread < 32u ? 1u : 2u;
  const uint in_block = thread & 3u, out_block = layer == 2u ? 0u : (thread >> 2) & 3u;
  const uint base = at + (layer == 0u ? 0u : layer == 1u ? MLP_W2 : MLP_W3);
  const uint bias = at + (layer == 0u ? MLP_B1 : layer == 1u ? MLP_B2 : MLP_B3);
  for (uint o = 0u; o < (layer == 2u ? 3u : 4u); ++o) {
    for (uint i = 0u; i < 4u; ++i)
      partial.v[base + (out_block * 4u + o) * 16u + in_block * 4u + i] = sums.weights[o][i];
    if (in_block == 0u) partial.v[bias + out_block * 4u + o] = sums.biases[o];
  }
}
#endif
