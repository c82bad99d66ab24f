// Code that is easily translated to lanes incorrectly. CASE selects one case per variant. Each invocation writes a few
// numbers.
#include "common/kernel.h"
#include "probe_args.h"

ARGUMENTS(ProbeArgs)
CONSTANT(0, uint, CASE, 0u);

struct Pair {
  uint a, b;
};

const uint kTable[5] = {7u, 11u, 13u, 17u, 19u};
SHARED uint s_words[64];
SHARED vec4 s_vectors[16];

// A branch changes a variable of the outer loop for some lanes only.
FN uint carried(uint n) {
  uint sum = 0u, kept = n;
  for (uint i = 0u; i < 5u; ++i) {
    if (((n >> i) & 1u) != 0u) {
      for (uint k = 0u; k < (n & 3u); ++k) kept = kept * 3u + i;
      sum += kept;
    }
    sum ^= i;
  }
  return sum + kept;
}

// Like carried(), but the variable is used only inside the branch.
FN uint carried_within(uint n) {
  uint sum = 0u, turns = 0u, hidden;
  for (uint i = 0u; i < 8u; ++i)
    if (((n >> i) & 1u) != 0u) {
      if (turns == 0u) hidden = n + i;
      hidden = hidden * 3u + i;
      turns += 1u;
      sum ^= hidden;
    }
  return sum;
}

// A structure is assigned member by member, in branches and across iterations.
FN uint by_member(uint n) {
  Pair p;
  p.a = n;
  p.b = 1u;
  for (uint i = 0u; i < 6u; ++i) {
    Pair q;
    if ((n & (1u << i)) != 0u) {
      q.a = p.b + i;
      q.b = p.a;
      p = q;
    } else {
      p.b += p.a;
    }
  }
  return p.a * 31u + p.b;
}

// Lanes leave a do-while loop one by one, until no lanes remain.
FN uint tested_late(uint n) {
  uint left = n % 9u, turns = 0u;
  do {
    turns = turns * 2u + 1u;
    left = left == 0u ? 0u : left - 1u;
  } while (left != 0u);
  return turns;
}

// All lanes continue with the next iteration of a loop that they leave one by one.
FN uint all_go_on(uint n, uint count) {
  uint sum = 0u;
  for (uint i = 0u; i < 12u; ++i) {
    if (i % 3u == count % 3u) continue;
    if (i > n % 12u) break;
    if ((n & i) == 1u) continue;
    sum = sum * 5u + i;
  }
  return sum;
}

// Some lanes return from two nested loops.
FN uint returns_early(uint n) {
  uint steps = 0u;
  for (uint i = 0u; i < 4u; ++i)
    for (uint k = 0u; k < 4u; ++k) {
      steps += k + 1u;
      if ((n + i * 4u + k) % 7u == 3u) return steps * 100u + i;
      if (k > (n & 3u)) break;
    }
  return steps;
}

// Each lane indexes an array shared by all lanes, and an array of its own.
FN uint indexed(uint n) {
  uint own[4] = {n, n + 1u, n * 2u, 9u};
  own[n & 3u] += kTable[n % 5u];
  return own[(n >> 2) & 3u] + kTable[(n >> 4) % 5u];
}

FN uint whole_numbers(uint n) {
  const int x = int(n) - 500;
  return n / ((n & 7u) + 1u) + n % 13u + uint(x / 7) + uint(findLSB(n | 256u)) + uint(x >> 3) + n / 16u;
}

KERNEL_MAIN(64) {
  const uint thread = gl_LocalInvocationIndex, n = a.numbers.v[thread];
  uint result = 0u, second = 0u;
  if (CASE == 0u) {
    result = carried(n);
    second = carried_within(n);
  }
  if (CASE == 1u) result = by_member(n);
  if (CASE == 2u) result = tested_late(n);
  if (CASE == 3u) result = all_go_on(n, a.count);
  if (CASE == 4u) result = returns_early(n);
  if (CASE == 5u) result = indexed(n);
  if (CASE == 6u) result = whole_numbers(n);
  if (CASE == 7u) {
    // Consecutive components of vectors. The last lanes are beyond the end, and some components are not written.
    for (uint i = 0u; i * 64u < a.count; ++i) {
      const uint e = i * 64u + thread;
      if (e < a.count) {
        const float x = a.vectors.v[2u + (e >> 2)][e & 3u];
        if ((n & 3u) != 0u) a.vectors.v[2u + (e >> 2)][e & 3u] = 2.0f * x + float(i);
      }
    }
    s_vectors[thread >> 2][thread & 3u] = float(n & 255u);
    barrier();
    result = uint(s_vectors[(63u - thread) >> 2][(63u - thread) & 3u]);
  }
  if (CASE == 8u) {
    // Values exchanged through shared memory with barriers, and sums by several threads.
    s_words[thread] = n;
    barrier();
    result = s_words[(thread * 7u + 5u) % 64u];
    barrier();
    if (thread < 4u) s_words[thread] = 0u;
    barrier();
    if ((n & 1u) != 0u) atomicAdd(s_words[n % 4u], n);
    barrier();
    second = s_words[thread & 3u];
  }
  if (CASE == 9u) {
    // Each group of eight threads loads eight consecutive words from an index that depends on the group. Inactive
    // groups may have any index.
    s_words[thread] = n;
    barrier();
    const uint eight = thread / 8u;
    if ((eight & 1u) == 0u || (n & 1u) != 0u) result = s_words[(eight * 5u + 3u) % 8u * 8u + thread % 8u];
    // The first lanes of the first group would read before the start of the array.
    const uint before = eight * 8u - 3u;
    if (thread >= 3u) result += s_words[before + thread % 8u];
    if (thread < 40u) {
      const uint far = (7u - eight) * (1u + eight / 5u * 100000000u);
      second = s_words[far * 8u + thread % 8u] + uint(sqrt(float(eight)) * 100.0f);
    }
  }
  a.result.v[thread * 4u] = result;
  if ((n & 8u) != 0u) a.result.v[thread * 4u + 1u] = second + 1u;
}
