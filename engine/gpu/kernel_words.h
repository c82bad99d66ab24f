// Definitions for compiling kernels with any C++ compiler. common/kernel.h documents the macros. The kernel_language.h
// of each backend defines KERNEL_TYPES, the namespace of its kernels, and includes this file.
#pragma once

#include <cstddef>
#include <cstdint>

#include <glm/glm.hpp>

#define TRISOUP_KERNEL_CODE
#include "common/language.h"

namespace KERNEL_TYPES {

using real = float;
using uint = std::uint32_t;
using glm::abs;
using glm::all;
using glm::any;
using glm::bvec2;
using glm::bvec4;
using glm::ceil;
using glm::clamp;
using glm::cross;
using glm::dot;
using glm::floatBitsToUint;
using glm::floor;
using glm::greaterThan;
using glm::ivec2;
using glm::mat4;
using glm::max;
using glm::min;
using glm::normalize;
using glm::outerProduct;
using glm::sign;
using glm::sqrt;
using glm::uintBitsToFloat;
using glm::uvec2;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

}  // namespace KERNEL_TYPES

// The values of the constants come from the variant that is compiled (kernel_variants.cmake).
#define CONSTANT(id, type, name, value) [[maybe_unused]] constexpr type name = static_cast<type>(KERNEL_CONSTANT_##id)
#define KERNEL(threads, Args) \
  ARGUMENTS(Args)             \
  KERNEL_MAIN(threads)
#define ARGUMENTS(Args) using KernelArgs = Args;
#define TAKES_ARGUMENTS const KernelArgs &a,
#define GIVES_ARGUMENTS a,
