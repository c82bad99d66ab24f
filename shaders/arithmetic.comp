// For soup-bench alone: multiplications and additions that wait for nothing but each other, to find the rate that no kernel exceeds.
#include "common/kernel.h"
#include "args/arithmetic.h"

KERNEL(64, ArithmeticArgs) {
  const uint i = thread_index();
  // As many vectors as hide the latency of one. Not an array: C++ compilers would keep it in memory. All numbers differ, or they would be computed once.
  vec4 x0 = vec4(0.0f, 0.25f, 0.5f, 0.75f) + vec4(float(i & 63u) * 0.001f), x1 = x0 + vec4(1.0f), x2 = x0 + vec4(2.0f), x3 = x0 + vec4(3.0f);
  vec4 x4 = x0 + vec4(4.0f), x5 = x0 + vec4(5.0f), x6 = x0 + vec4(6.0f), x7 = x0 + vec4(7.0f);
  for (uint k = 0u; k < a.rounds; ++k) {
    x0 = x0 * a.factor + a.summand;
    x1 = x1 * a.factor + a.summand;
    x2 = x2 * a.factor + a.summand;
    x3 = x3 * a.factor + a.summand;
    x4 = x4 * a.factor + a.summand;
    x5 = x5 * a.factor + a.summand;
    x6 = x6 * a.factor + a.summand;
    x7 = x7 * a.factor + a.summand;
  }
  const vec4 sum = x0 + x1 + x2 + x3 + x4 + x5 + x6 + x7;
  a.result.v[i] = sum.x + sum.y + sum.z + sum.w;
}
