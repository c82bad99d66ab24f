// The model: opaque triangles that share no vertices, each with a texture on a barycentric lattice, and one small MLP.
// Tojo, Bickel, Umetani, "DiffSoup", CVPR 2026 (arXiv 2603.27151).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

inline constexpr int kChannels = 8;  // 0..2 base rgb, 3 residual weight, 4..6 latent, 7 opacity
/// Highest texture level. All levels of a triangle, four channels at a time, must fit in the 16 KiB of shared memory
/// that every device has.
inline constexpr int kMaxLevel = 5;

/// Number of samples of a lattice of level R: points (x, y) with x + y <= 2^R. 3, 6, 15, 45, 153, 561 for R = 0..5.
constexpr std::uint32_t samples_at(std::uint32_t level) {
  return level == 0 ? 3u : ((1u << (level - 1)) + 1u) * ((1u << level) + 1u);
}
/// Number of samples of levels min..max stored one after the other.
constexpr std::uint32_t samples_in(std::uint32_t level_min, std::uint32_t level_max) {
  std::uint32_t n = 0;
  for (std::uint32_t l = level_min; l <= level_max; ++l) n += samples_at(l);
  return n;
}

/// A row of the texture table: where a triangle's texture is stored. Offsets count samples (of kChannels values), not
/// floats. Kernels use the same layout.
struct TextureEntry {
  std::uint32_t source_offset = 0;   // into the logits: levels level_min..level_max, one after the other
  std::uint32_t lattice_offset = 0;  // into the summed lattice of level_max, after the sigmoid
  std::uint32_t level_min = 0;
  std::uint32_t level_max = 0;
};

/// MLP with layers 16 -> 16 -> 16 -> 3. Matrices are row-major [out][in]; order: w1 b1 w2 b2 w3 b3.
struct Mlp {
  static constexpr int kInput = 16, kHidden = 16, kOutput = 3;
  static constexpr int kParameters =
      kInput * kHidden + kHidden + kHidden * kHidden + kHidden + kHidden * kOutput + kOutput;
  std::vector<float> parameters = std::vector<float>(kParameters, 0.0f);
};

/// Gains at the places of a picture (shaders/common/exposure.h).
using ExposureGrid = std::array<glm::vec3, 25>;
inline ExposureGrid even_exposure(const glm::vec3& gain) {
  ExposureGrid grid;
  grid.fill(gain);
  return grid;
}

/// What the model's colours become in a training photograph (shaders/common/exposure.h), and where it was taken.
struct PhotographExposure {
  std::string name;                          // UTF-8, relative to the dataset
  double focal = 0, aspect = 0;              // focal length by the longer side, longer by shorter side
  glm::dvec3 position{0.0}, direction{0.0};  // of its camera, normalised coordinates; viewing direction
  ExposureGrid gain{};
};

/// A trained soup: 8-bit lattices after the sigmoid, as in the model file and the renderer.
struct Model {
  std::vector<glm::vec3> vertices;     // 3 per triangle; dataset coordinates minus `origin`
  glm::dvec3 origin{0.0};              // nonzero if floats cannot represent the dataset coordinates precisely enough
  std::vector<TextureEntry> textures;  // source_offset is 0: a model has no levels below level_max
  std::vector<std::uint8_t> lattice;   // kChannels per sample, value = round(255 * sigmoid)
  Mlp mlp;
  glm::vec3 background{0.0f};
  /// Triangles that reach the camera plane are discarded instead of clipped. Comes from the training settings; the file
  /// itself does not store it.
  bool drop_near = false;
  glm::dvec3 centre{0.0};  // normalised = scale * (dataset - centre), see scene::Normalisation
  double scale = 1.0;
  std::vector<PhotographExposure> exposures;  // empty: none differs
  std::size_t triangles() const { return textures.size(); }
};

/// Returns the vertices of a model in normalised coordinates.
inline std::vector<glm::vec3> normalised_vertices(const Model& model) {
  std::vector<glm::vec3> vertices;
  vertices.reserve(model.vertices.size());
  for (const glm::vec3& v : model.vertices)
    vertices.emplace_back(model.scale * (glm::dvec3(v) + (model.origin - model.centre)));
  return vertices;
}

}  // namespace trisoup::soup
