// Types that the kernels' arguments point to. One definition for GLSL and C++.
#ifndef TRISOUP_ARGS_TYPES_H
#define TRISOUP_ARGS_TYPES_H

#ifdef GL_core_profile
#define STRUCT struct
#else
#include <cstdint>
#include <glm/glm.hpp>
#include "common/language.h"
// Kernels compiled as C++ see pointers; all other code sees addresses. The two sets of types are in two namespaces.
#ifndef KERNEL_TYPES
#define KERNEL_TYPES trisoup::kernels
#endif
namespace KERNEL_TYPES {
using uint = std::uint32_t;
using glm::mat4;
using glm::vec4;
#define STRUCT struct alignas(16)
#endif

// Kernels must not convert between these types or select between two values: SwiftShader cannot compile either.
#ifdef GL_core_profile
#define POINTER_TYPE(name, type, alignment) \
  layout(buffer_reference, std430, buffer_reference_align = alignment) buffer name { type v[]; };
#define COHERENT_POINTER_TYPE(name, type, alignment) \
  layout(buffer_reference, std430, buffer_reference_align = alignment) coherent buffer name { type v[]; };
POINTER_TYPE(Uints, uint, 4)
POINTER_TYPE(Floats, float, 4)
#elif defined(TRISOUP_KERNEL_CODE)
#define POINTER_TYPE(name, type, alignment) \
  struct name {                             \
    ELEMENTS(type, alignment) v;            \
  };
#define COHERENT_POINTER_TYPE POINTER_TYPE
POINTER_TYPE(Uints, uint, 4)
POINTER_TYPE(Floats, float, 4)
#endif

/// A view of a batch. Batch buffers hold the views' pixels one after the other, starting with the row at NDC y = -1.
STRUCT ViewRecord {
  mat4 clip_from_world;
  // Direction from the surface towards the camera at NDC (x, y): ray + x ray_x + y ray_y, not normalised.
  vec4 ray, ray_x, ray_y;
  // Shading sees the surface from `eye_shift` beside the eye, times the depth range, far - near. 1 / clip w of a
  // fragment is inverse_w + inverse_w_by_z times its NDC z.
  vec4 eye_shift;
  uint width, height;
  uint tiles_x, tiles_y;
  uint pixel_offset;        // index of its first pixel in the batch buffers
  uint tile_offset;         // index of its first tile
  uint block_offset;        // index of its first block of 16 x 16 pixels
  uint index;               // of the view in the dataset; part of the thresholds' counter
  POINTER(Uints) photo;     // see common/photograph.h
  float photograph_pixels;  // photograph pixels per pixel of this view
  uint depth_size;          // of the depth map: width | height << 16; 0: there is none
  // Sampling of the photograph: pixel (x, y) uses the 4 x 4 photograph pixels starting at (x + first_x, y + first_y)
  // with these weights.
  vec4 taps_x, taps_y;  // multiples of 1/128 that sum to 1
  int first_x, first_y;
  POINTER(Floats) depth;  // depth map of the same field of view: inverse depth; 0: not measured
  uint background;        // of this view, RGBA8; alpha 0: the background of the batch, on which the photographs are
  float inverse_w, inverse_w_by_z;
  uint pad0;
};

/// A triangle in one view. Pixels x, y in 16 bits each; the box is empty if min > max.
STRUCT ScreenTriangle {
  vec4 p0, p1, p2;  // clip coordinates
  uint box_min, box_max;
  uint crosses;  // 1: the near plane cuts it
  uint pad0;
};

/// The visible fragment of a pixel.
STRUCT Hit {
  uint triangle;  // index + 1; 0: none
  float b0, b1;   // perspective-correct barycentrics of the first two vertices
  float depth;    // NDC z
};

/// soup::TextureEntry
STRUCT Texture { uint source_offset, lattice_offset, level_min, level_max; };

/// The texture of one triangle, in a list sorted by size.
STRUCT TextureTask {
  uint source_offset, lattice_offset;
  uint levels;    // level_min | level_max << 8
  uint triangle;  // index on its rank, starting at 0
};

/// The arguments that change every step. All others stay the same until the next refinement.
STRUCT StepState {
  uint threshold_key;  // hash of seed and step
  uint step;
  float lr_texture, second_texture;  // see common/optimiser.h
  float lr_vertex, second_vertex;
  float lr_mlp, second_mlp;
  float pixel_weight;   // 1 / (3 x pixels of the batch)
  float window_weight;  // 1 / (3 x SSIM windows of the batch); 0 when no view is large enough for one
  uint slot;            // row of the statistics
  float error_slope;    // factor from error to gradient, which is clamped to 1 (loss_gradient.comp)
  float depth_weight;   // of each pixel in the depth loss (depth_gradient.comp)
  uint pad0, pad1, pad2;
};

/// Sums over a batch in fixed point (common/fixed_point.h), low and high words.
STRUCT Statistics {
  uint l1_low, l1_high;      // mean |C - target|
  uint ssim_low, ssim_high;  // mean SSIM
  uint mse_low, mse_high;    // mean (C - target)^2
  uint pad0, pad1;
};

/// Sums over one view: fixed point in units of IMAGE_SUM_UNIT, and counts.
STRUCT ImageSums {
  uint l1_low, l1_high;      // |C - target|, three channels
  uint mse_low, mse_high;    // (C - target)^2, three channels
  uint ssim_low, ssim_high;  // SSIM of the windows, three channels
  uint pixels;               // inside the loss mask
  uint uncovered;            // of those: pixels without a triangle where the photograph differs from the background
  uint windows;              // of which ssim is the sum
  uint pad0, pad1, pad2;
};
// A power of two. Sums of up to 2^27 pixels stay in range; the sum of a block stays below kFixedLimit.
#define IMAGE_SUM_UNIT 1024.0f

/// Non-finite parameters that were reset (common/non_finite.h).
STRUCT NonFiniteRecord {
  uint count;  // since the host last read it
  uint index;  // of the first: index of the float in its array
  uint step;   // step in which it was found
  uint pad0;
};
#define NON_FINITE_VERTEX 0
#define NON_FINITE_TEXEL 1
#define NON_FINITE_WEIGHT 2

/// Flags that persist between steps.
STRUCT Control {
  uint list_total;                // entries that the tile lists of the last step needed
  uint overflow;                  // 1: the lists did not fit; parameters have not changed since
  uint list_peak;                 // maximum over all steps
  uint overflow_step;             // the first step whose lists did not fit
  NonFiniteRecord non_finite[3];  // indexed by NON_FINITE_
};

#if defined(GL_core_profile) || defined(TRISOUP_KERNEL_CODE)
COHERENT_POINTER_TYPE(CoherentFloats, float, 4)  // written by threads of a workgroup and read by others in it
POINTER_TYPE(Float4s, vec4, 16)
POINTER_TYPE(Uint4s, uvec4, 16)
POINTER_TYPE(Views, ViewRecord, 16)
POINTER_TYPE(ScreenTriangles, ScreenTriangle, 16)
POINTER_TYPE(Hits, Hit, 16)
POINTER_TYPE(Textures, Texture, 16)
POINTER_TYPE(TextureTasks, TextureTask, 16)
POINTER_TYPE(Steps, StepState, 16)
POINTER_TYPE(StatisticsRows, Statistics, 16)
POINTER_TYPE(Controls, Control, 16)
#endif
#ifndef GL_core_profile
static_assert(sizeof(ViewRecord) == 240 && sizeof(ScreenTriangle) == 64 && sizeof(Hit) == 16 && sizeof(Texture) == 16 &&
              sizeof(TextureTask) == 16);
static_assert(offsetof(StepState, slot) == 4 * 10);  // begin_step.comp
static_assert(sizeof(StepState) == 64 && sizeof(Statistics) == 32 && sizeof(ImageSums) == 48 && sizeof(Control) == 64);
}
#endif
#undef STRUCT

#endif
