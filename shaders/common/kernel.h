// Included first by every kernel. Kernels are GLSL; the capitalised macros let a C++ compiler compile the same code
// (engine/gpu/host/kernel_language.h). ELEMENTS, used in args/types.h, points to an array of a type with an alignment.
#ifdef GL_core_profile
#include "common/language.h"
#include "args/types.h"

/// The kernel's main function. threads: size of a workgroup. Args: arguments of a launch, available as `a`.
#define KERNEL(threads, Args) \
  ARGUMENTS(Args)             \
  KERNEL_MAIN(threads)
/// The two parts of KERNEL for a kernel with helper functions, which stand between them. A helper that uses `a` is
/// declared as f(TAKES_ARGUMENTS uint x) and called as f(GIVES_ARGUMENTS x). An ordinary parameter would copy a
/// structure of pointers, which SwiftShader cannot compile.
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
/// Sets a word of memory to 1. Any number of threads may do so at once.
#define MARK(word) word = 1u

/// Index of the workgroup. Launches that exceed one dimension are folded into two.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }
/// Index of the thread in a launch with workgroups of 64.
uint thread_index() { return group_index() * 64u + gl_LocalInvocationIndex; }
#endif
