// What every kernel starts with. A kernel is GLSL; the words in capitals are what a C++ compiler takes for the same
// (engine/gpu/host/kernel_language.h). ELEMENTS, in args/types.h, is what points to an array of a type with an
// alignment.
#ifdef GL_core_profile
#include "common/language.h"
#include "args/types.h"

/// The kernel's main function: threads of a workgroup, and the arguments of a launch, called `a`.
#define KERNEL(threads, Args) \
  ARGUMENTS(Args)             \
  KERNEL_MAIN(threads)
/// The two by themselves, for a kernel with functions that use its arguments: they stand between, as f(TAKES_ARGUMENTS
/// uint x), and are called as f(GIVES_ARGUMENTS x). An ordinary parameter would be a copy of a structure of pointers,
/// which is more than SwiftShader can compile.
#define ARGUMENTS(Args) \
  layout(push_constant) uniform Push { Args a; };
#define KERNEL_MAIN(threads)         \
  layout(local_size_x = threads) in; \
  void main()
#define TAKES_ARGUMENTS
#define GIVES_ARGUMENTS
/// A specialisation constant.
#define CONSTANT(id, type, name, value) layout(constant_id = id) const type name = value
#define SHARED shared
/// Sets a word of memory to 1, as any number of threads may at once.
#define MARK(word) word = 1u

/// Number of the workgroup; launches larger than one dimension allows are folded into two.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
/// Number of the thread in a launch of workgroups of 64.
uint thread_index() { return group_index() * 64u + gl_LocalInvocationIndex; }
#endif
