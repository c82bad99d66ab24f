// Copies the next step's row of the step queue to fixed addresses. The commands of all steps are therefore identical,
// and the host does not have to intervene between steps. One workgroup.
#include "common/kernel.h"
#include "args/begin_step.h"
#include "common/fixed_point.h"

const uint kStateWords = 16u;  // size of a StepState
const uint kSlotWord = 10u;    // position of its slot

KERNEL(64, BeginStepArgs) {
  const uint thread = gl_LocalInvocationIndex;
  const uint row = a.cursor.v[0];
  barrier();
  if (thread == 0u) {
    a.cursor.v[0] = row + 1u;
    const uint slot = a.schedule.v[row * a.row_words + kSlotWord];
    Statistics zero;
    zero.l1_low = zero.ssim_low = zero.mse_low = kFixedZero;
    zero.l1_high = zero.ssim_high = zero.mse_high = zero.pad0 = zero.pad1 = 0u;
    a.statistics.v[slot] = zero;
  }
  for (uint i = thread; i < kStateWords; i += 64u) a.state.v[i] = a.schedule.v[row * a.row_words + i];
  for (uint i = thread; i < a.view_words; i += 64u) a.views.v[i] = a.schedule.v[row * a.row_words + kStateWords + i];
}
