// Arguments of update_mlp.comp.
#ifndef TRISOUP_ARGS_UPDATE_MLP_H
#define TRISOUP_ARGS_UPDATE_MLP_H
#include "args/types.h"
#ifndef GL_core_profile
namespace KERNEL_TYPES {
#endif

/// Sums the workgroups' MLP gradients and applies Adam. Eight parameters per workgroup.
struct UpdateMlpArgs {
  POINTER(Floats) mlp;
  POINTER(Floats) moment1;
  POINTER(Floats) moment2;
  POINTER(Floats) mlp_partial;
  POINTER(Steps) state;
  POINTER(Controls) control;
  POINTER(Floats) debug;
  uint groups, pad;
};

#ifndef GL_core_profile
}
#endif
#endif
