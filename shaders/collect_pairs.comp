// Collects the set of (triangle, triangle behind it) over all pixels of a batch in a hash table with open addressing. A
// slot holds 1 + a pixel that shows the pair. The pixels were written by earlier launches, so one compare-and-swap per
// slot is enough.
#include "common/kernel.h"
#include "args/collect_pairs.h"
#include "common/random.h"

const uint kMostProbes = 64u;

KERNEL(64, CollectPairsArgs) {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint first = a.first.v[i].triangle, behind = a.behind.v[i].triangle;
  if (first == 0u || behind == 0u) return;
  // Neighbouring pixels usually show the same pair.
  if (i > 0u && a.first.v[i - 1u].triangle == first && a.behind.v[i - 1u].triangle == behind) return;
  uint slot = hash32(first ^ hash32(behind)) & (a.slots - 1u);
  uint probe = 0u;
  for (; probe < kMostProbes; ++probe) {
    const uint taken = atomicCompSwap(a.table.v[slot], 0u, i + 1u);
    if (taken == 0u) {
      const uint at = atomicAdd(a.found.v[0], 1u);
      if (at < a.capacity) {
        a.found.v[1u + 2u * at] = first - 1u;
        a.found.v[2u + 2u * at] = behind - 1u;
      }
      break;
    }
    if (a.first.v[taken - 1u].triangle == first && a.behind.v[taken - 1u].triangle == behind) break;
    slot = (slot + 1u) & (a.slots - 1u);
  }
  // The table is full: the host must retry with a larger one.
  if (probe == kMostProbes) atomicOr(a.found.v[0], 0x80000000u);
}
