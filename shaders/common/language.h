// Common subset of GLSL, CUDA and C++ for the maths of this folder and the kernels. Maths headers have no include
// guards and include nothing: kernels include the ones they need, and common/host.h includes all of them twice, for
// float and double.
#ifdef GL_core_profile
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_control_flow_attributes : require
#define real float
#define FN
#define IN(type) const in type
#define OUT(type) out type
#define INOUT(type) inout type
#define IN_ARRAY_OF(type, name, n) type name[n]
#define OUT_ARRAY_OF(type, name, n) out type name[n]
#define INOUT_ARRAY_OF(type, name, n) inout type name[n]
#define UNROLL [[unroll]]
#define POINTER(type) type
// Rounded identically everywhere: no contraction, no reordering.
#define PRECISE precise
#else
#ifdef __CUDACC__
#define FN __device__ inline
#define UNROLL _Pragma("unroll")
#else
#define FN inline
#define UNROLL
#endif
#define IN(type) const type&
#define OUT(type) type&
#define INOUT(type) type&
#define IN_ARRAY_OF(type, name, n) const type* name
#define OUT_ARRAY_OF(type, name, n) type* name
#define INOUT_ARRAY_OF(type, name, n) type* name
#define PRECISE
#ifdef TRISOUP_KERNEL_CODE
#define POINTER(type) type
#else
#define POINTER(type) std::uint64_t
#endif
#endif
#define IN_ARRAY(name, n) IN_ARRAY_OF(real, name, n)
#define OUT_ARRAY(name, n) OUT_ARRAY_OF(real, name, n)
