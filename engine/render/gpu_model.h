// A model in the form the renderer draws: 8-bit textures in atlases, and triangles sorted by what their opacity asks
// for.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/graphics.h"
#include "mesh/inner_box.h"
#include "soup/soup.h"

namespace trisoup::render {

/// Everything is in the model's normalised coordinates: scale * (dataset - centre).
struct GpuModel {
  std::uint32_t triangles = 0;               // of the model
  std::uint32_t opaque = 0;                  // of them, at least a half everywhere: drawn without looking at opacity
  std::uint32_t masked = 0;                  // a half somewhere
  gpu::Buffer corners;                       // [3 (opaque + masked)] kernels::SoupVertex, the opaque ones first
  std::vector<std::uint32_t> mlp_constants;  // the MLP's parameters, bit for bit; empty: shaders read them from `mlp`
  gpu::Buffer mlp;                           // uniform buffer, 149 vec4
  gpu::Image opacities;                      // r8, one byte per lattice point
  gpu::Image features;                       // rgba8: a layer of features 0..3, then one of 4..7, per page
  gpu::Image table;                          // rgba32_uint, a column per triangle: shaders/common/soup_table.h
  glm::vec3 background{0.0f};
  glm::dvec3 centre{0.0};  // of the normalisation
  double scale = 1.0;
  soup::Box box;  // around 98 % of the vertices along each axis
};

/// What becomes of the MLP: compiled into the shaders for a model that stays, or read by them for one that changes.
enum class MlpUse { compiled, read };

/// Throws Error when the device cannot hold or draw it.
GpuModel upload_model(gpu::Device& gpu, const soup::Model& model, MlpUse mlp = MlpUse::compiled);

}  // namespace trisoup::render
