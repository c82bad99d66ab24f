// Arguments of begin_step.comp.
#ifndef TRISOUP_ARGS_BEGIN_STEP_H
#define TRISOUP_ARGS_BEGIN_STEP_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// The next row of the step queue, as words: a StepState, then the ViewRecords of a batch.
struct BeginStepArgs {
  POINTER(Uints) schedule;  // [rows][row_words]
  POINTER(Uints) cursor;    // [1] index of the next row
  POINTER(Uints) state;
  POINTER(Uints) views;  // [view_words]
  POINTER(StatisticsRows) statistics;
  uint row_words, view_words;
};

#ifndef GL_core_profile
}
#endif
#endif
