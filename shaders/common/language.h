// The subset in which GLSL, CUDA and C++ share the maths of this folder. The maths headers have no include guards and include
// nothing: GLSL kernels include those they need, and common/host.h includes them all twice, in float and in double.
#ifdef GL_core_profile
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_control_flow_attributes : require
#define real float
#define FN
#define IN_ARRAY(name, n) real name[n]
#define OUT_ARRAY(name, n) out real name[n]
#define OUT(type) out type
#define INOUT(type) inout type
#define UNROLL [[unroll]]
#define POINTER(type) type
// Rounded the same wherever it is computed: no contraction, no reordering.
#define PRECISE precise
#else
#define FN inline
#define IN_ARRAY(name, n) const real* name
#define OUT_ARRAY(name, n) real* name
#define OUT(type) type&
#define INOUT(type) type&
#define UNROLL
#define PRECISE
#define POINTER(type) trisoup::gpu::Address
#endif
