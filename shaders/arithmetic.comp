// For soup-bench alone: multiplications and additions that wait for nothing but each other, to find the rate that no
// kernel exceeds.
#include "common/kernel.h"
#include "args/arithmetic.h"

KERNEL(64, ArithmeticArgs) {
  const uint i = thread_index();
  // As many numbers as hide the latency of one, and no more than 16 registers hold beside the two that all share.
  float x[14];
  UNROLL for (uint c = 0u; c < 14u; ++c) x[c] = float(i & 63u) * 0.001f + float(c);
  for (uint k = 0u; k < a.rounds; ++k) {
    UNROLL for (uint c = 0u; c < 14u; ++c) x[c] = x[c] * a.factor + a.summand;
  }
  float sum = 0.0f;
  UNROLL for (uint c = 0u; c < 14u; ++c) sum += x[c];
  a.result.v[i] = sum;
}
