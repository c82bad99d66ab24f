// What every kernel starts with. A kernel is GLSL; the words in capitals are what a C++ compiler takes for the same
// (engine/gpu/host/kernel_language.h). ELEMENTS, in args/types.h, is what points to an array of a type with an alignment.
#ifdef GL_core_profile
#include "common/language.h"
#include "args/types.h"

/// The kernel's main function: threads of a workgroup, and the arguments of a launch, called `a`.
#define KERNEL(threads, Args)                  \
  layout(local_size_x = threads) in;           \
  layout(push_constant) uniform Push { Args a; }; \
  void main()
/// A specialisation constant.
#define CONSTANT(id, type, name, value) layout(constant_id = id) const type name = value
#define SHARED shared
/// Sets a word of memory to 1, as any number of threads may at once.
#define MARK(word) word = 1u
/// Memory that threads of a workgroup write and others of it read.
#define COHERENT_POINTER(name, type) \
  layout(buffer_reference, std430, buffer_reference_align = 4) coherent buffer name { type v[]; };

/// Number of the workgroup; launches larger than one dimension allows are folded into two.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
/// Number of the thread in a launch of workgroups of 64.
uint thread_index() { return group_index() * 64u + gl_LocalInvocationIndex; }
#endif
