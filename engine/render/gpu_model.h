// A model in the form the renderer uses: 8-bit textures in atlases, and triangles sorted into opaque and masked.
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/graphics.h"
#include "mesh/inner_box.h"
#include "soup/soup.h"

namespace trisoup::render {

/// All geometry is in the model's normalised coordinates: scale * (dataset - centre).
struct GpuModel {
  std::uint32_t triangles = 0;               // of the model
  std::uint32_t opaque = 0;                  // triangles with opacity >= 0.5 everywhere: drawn without an opacity test
  std::uint32_t masked = 0;                  // triangles with opacity >= 0.5 only in places: drawn with an opacity test
  gpu::Buffer corners;                       // [3 (opaque + masked)] kernels::SoupVertex, opaque triangles first
  std::vector<std::uint32_t> mlp_constants;  // the bits of the MLP's parameters; empty: shaders read them from `mlp`
  gpu::Buffer mlp;                           // uniform buffer, 149 vec4
  gpu::Image opacities;                      // r8, one byte per lattice point
  gpu::Image features;                       // rgba8; per page a layer of features 0..3 and a layer of features 4..7
  gpu::Image table;                          // rgba32_uint, one column per triangle: shaders/common/soup_table.h
  glm::vec3 background{0.0f};
  glm::dvec3 centre{0.0};  // of the normalisation
  double scale = 1.0;
  soup::Box box;  // contains 98 % of the vertices along each axis
};

/// How shaders get the MLP: compiled in, for a model that does not change, or read from a buffer.
enum class MlpUse { compiled, read };

/// Uploads a model. Throws Error if the device cannot hold or draw it.
GpuModel upload_model(gpu::Device& gpu, const soup::Model& model, MlpUse mlp = MlpUse::compiled);

}  // namespace trisoup::render
