// The model: opaque triangles that share nothing, each with a texture on a barycentric lattice, and one small MLP.
// Tojo, Bickel, Umetani, "DiffSoup", CVPR 2026 (arXiv 2603.27151).
#pragma once

#include <cstdint>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

inline constexpr int kChannels = 8;  // 0..2 base rgb, 3 residual weight, 4..6 latent, 7 opacity
inline constexpr int kMaxLevel =
    5;  // all levels of a triangle, four channels at a time, fit in the 16 KiB of shared memory that every device has

/// Samples of one lattice level R: points (x, y) with x + y <= 2^R; 3, 6, 15, 45, 153, 561 for R = 0..5.
constexpr std::uint32_t samples_at(std::uint32_t level) {
  return level == 0 ? 3u : ((1u << (level - 1)) + 1u) * ((1u << level) + 1u);
}
/// Samples of levels min..max stored one after the other.
constexpr std::uint32_t samples_in(std::uint32_t level_min, std::uint32_t level_max) {
  std::uint32_t n = 0;
  for (std::uint32_t l = level_min; l <= level_max; ++l) n += samples_at(l);
  return n;
}

/// Where a triangle's texture lives; one row of the texture table. Offsets count samples (of kChannels values), not
/// floats. Layout shared with the kernels.
struct TextureEntry {
  std::uint32_t source_offset = 0;   // into the logits: levels level_min..level_max, one after the other
  std::uint32_t lattice_offset = 0;  // into the summed lattice of level_max, after the sigmoid
  std::uint32_t level_min = 0;
  std::uint32_t level_max = 0;
};

/// 16 -> 16 -> 16 -> 3. Row-major [out][in], in this order: w1 b1 w2 b2 w3 b3.
struct Mlp {
  static constexpr int kInput = 16, kHidden = 16, kOutput = 3;
  static constexpr int kParameters =
      kInput * kHidden + kHidden + kHidden * kHidden + kHidden + kHidden * kOutput + kOutput;
  std::vector<float> parameters = std::vector<float>(kParameters, 0.0f);
};

/// A trained soup as it is drawn: 8-bit lattices after the sigmoid, as the model file and the renderer hold them.
struct Model {
  std::vector<glm::vec3> vertices;     // 3 per triangle, dataset coordinates less `origin`
  glm::dvec3 origin{0.0};              // not 0 where floats would have too few digits for the whole
  std::vector<TextureEntry> textures;  // source_offset is 0: a model has no levels below level_max
  std::vector<std::uint8_t> lattice;   // kChannels per sample, value = round(255 * sigmoid)
  Mlp mlp;
  glm::vec3 background{0.0f};
  bool drop_near =
      false;  // made to be drawn without the triangles that reach the camera plane; of the settings, not the file's own
  glm::dvec3 centre{0.0};  // normalised = scale * (dataset - centre), see scene::Normalisation
  double scale = 1.0;
  std::size_t triangles() const { return textures.size(); }
};

/// The vertices of a model in its normalised coordinates.
inline std::vector<glm::vec3> normalised_vertices(const Model& model) {
  std::vector<glm::vec3> vertices;
  vertices.reserve(model.vertices.size());
  for (const glm::vec3& v : model.vertices)
    vertices.emplace_back(model.scale * (glm::dvec3(v) + (model.origin - model.centre)));
  return vertices;
}

}  // namespace trisoup::soup
