// Used only by soup-bench: multiplications and additions without other dependencies, to measure the peak rate of the
// device.
#include "common/kernel.h"
#include "args/arithmetic.h"

KERNEL(64, ArithmeticArgs) {
  const uint i = thread_index();
  // Enough numbers to hide the latency of one operation, and few enough for 16 registers together with the two shared
  // operands.
  float x[14];
  UNROLL for (uint c = 0u; c < 14u; ++c) x[c] = float(i & 63u) * 0.001f + float(c);
  for (uint k = 0u; k < a.rounds; ++k) {
    UNROLL for (uint c = 0u; c < 14u; ++c) x[c] = x[c] * a.factor + a.summand;
  }
  float sum = 0.0f;
  UNROLL for (uint c = 0u; c < 14u; ++c) sum += x[c];
  a.result.v[i] = sum;
}
