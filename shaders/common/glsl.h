// What every GLSL kernel starts with.
#include "common/language.h"
#include "args/types.h"

/// Number of the workgroup; launches larger than one dimension allows are folded into two.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
/// Number of the thread in a launch of workgroups of 64. (gl_WorkGroupSize is 1 before a kernel states its own.)
uint thread_index() { return group_index() * 64u + gl_LocalInvocationIndex; }
