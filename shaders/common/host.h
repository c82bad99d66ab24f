// The shared maths for C++: trisoup::f32, identical to the kernels, and trisoup::f64 for finite differences.
#pragma once

#include <cstdint>

#include <glm/glm.hpp>

#include "common/language.h"

// The function bodies are shared with the kernels. GLM provides the functions that are built into GLSL.
#define TRISOUP_MATHS_TYPES(scalar) \
  using real = scalar;              \
  using uint = std::uint32_t;       \
  using vec2 = glm::vec<2, scalar>; \
  using vec3 = glm::vec<3, scalar>; \
  using vec4 = glm::vec<4, scalar>; \
  using glm::abs;                   \
  using glm::clamp;                 \
  using glm::cross;                 \
  using glm::dot;                   \
  using glm::exp;                   \
  using glm::floor;                 \
  using glm::max;                   \
  using glm::min;                   \
  using glm::normalize;             \
  using glm::sqrt;

namespace trisoup::f32 {
TRISOUP_MATHS_TYPES(float)
#include "common/coverage.h"
#include "common/covisibility.h"
#include "common/pixel_centre.h"
#include "common/edges.h"
#include "common/depth.h"
#include "common/camera_motion.h"
#include "common/exposure.h"
#include "common/lattice.h"
#include "common/optimiser.h"
#include "common/photograph.h"
#include "common/random.h"
#include "common/ray_triangle.h"
#include "common/shading.h"
#include "common/ssim.h"
}  // namespace trisoup::f32

namespace trisoup::f64 {
TRISOUP_MATHS_TYPES(double)
#include "common/coverage.h"
#include "common/covisibility.h"
#include "common/pixel_centre.h"
#include "common/edges.h"
#include "common/depth.h"
#include "common/camera_motion.h"
#include "common/exposure.h"
#include "common/lattice.h"
#include "common/optimiser.h"
#include "common/photograph.h"
#include "common/random.h"
#include "common/ray_triangle.h"
#include "common/shading.h"
#include "common/ssim.h"
}  // namespace trisoup::f64
