// A soup in device memory, with its optimiser state and gradients.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "soup/soup.h"
#include "train/step/soup_partition.h"

namespace trisoup::train {

/// Gradients are sums in 64-bit fixed point (shaders/common/fixed_point.h): low words and high words.
struct FixedSums {
  gpu::Buffer low, high;
};

/// Triangles whose textures take about as much shared memory, in SoupBuffers::tasks.
struct TextureClass {
  std::uint32_t first = 0, count = 0;
  std::uint32_t samples = 0;  // largest number of samples of one of the textures, over all levels
};

struct SoupBuffers {
  std::uint32_t triangles = 0;
  std::vector<soup::TextureEntry> table;  // offsets are those of one pool with the textures of all ranks
  std::uint64_t source_samples = 0, lattice_samples = 0;
  std::uint32_t level_max = 0;  // over all triangles
  bool drop_near = false;       // as published: what reaches the camera plane is dropped whole, not clipped
  SoupPartition* partition = &whole_soup();
  std::vector<TriangleRange> ranges;  // triangles of each rank. [ranks]

  /// Triangles that this rank owns: it alone has their textures.
  TriangleRange own() const;
  /// Index of a triangle's first source sample (of all levels) or first lattice sample (of the finest). For triangle ==
  /// triangles, the number of samples.
  std::uint64_t source_at(std::uint32_t triangle) const {
    return triangle < triangles ? table[triangle].source_offset : source_samples;
  }
  std::uint64_t lattice_at(std::uint32_t triangle) const {
    return triangle < triangles ? table[triangle].lattice_offset : lattice_samples;
  }

  gpu::Buffer vertices, vertex_moment1, vertex_moment2;  // [T][3][3], [3T][3], [3T]
  FixedSums vertex_gradient;                             // [T][3][3]
  gpu::Buffer textures;                                  // [T] Texture, from local_rows()
  gpu::Buffer tasks;                                     // [own] TextureTask, sorted by class
  std::vector<TextureClass> classes;                     // small textures first
  // Of own triangles only. BatchBuffers::sorted() has the gradients of the features.
  gpu::Buffer source, source_moment1, source_moment2;  // [source samples][8], logits
  gpu::Buffer lattice, opacity;  // [lattice samples][8], [lattice samples]; sums of the levels after the sigmoid
  FixedSums opacity_gradient;    // [lattice samples]
  gpu::Buffer touched;           // [T] 0: the triangle's opacity_gradient is zero
  gpu::Buffer mlp, mlp_moment1, mlp_moment2;  // [MLP_COUNT]
};

/// Bytes of textures with their opacities, moments and gradients, which ranks divide among them. source_samples: of all
/// levels; lattice_samples: of the finest levels.
constexpr std::uint64_t texture_bytes(std::uint64_t source_samples, std::uint64_t lattice_samples) {
  return source_samples * 3 * soup::kChannels * 4 + lattice_samples * (soup::kChannels * 4 + 12);
}
/// Bytes of the buffers that every rank has for all triangles: vertices with moments and gradients, texture table.
constexpr std::uint64_t triangle_bytes(std::uint64_t triangles) {
  return triangles * (36 + 36 + 12 + 72 + 4 + 2 * sizeof(soup::TextureEntry));
}
/// Device memory in bytes on each of `ranks` ranks of a soup of `triangles` with texture levels level_min..level_max,
/// including gradients and moments.
std::uint64_t soup_bytes(std::uint64_t triangles, std::uint32_t level_min, std::uint32_t level_max,
                         std::uint32_t ranks = 1);

/// The rows of `table` with offsets relative to the first sample of `own`. Rows of other triangles keep their levels
/// and get offset 0, because inactive lanes on a CPU read textures too.
std::vector<soup::TextureEntry> local_rows(std::span<const soup::TextureEntry> table, TriangleRange own);

/// Initial logits and moments of own triangles. An empty buffer stands for zeros.
struct Textures {
  gpu::Buffer source, moment1, moment2;
};

/// A logit whose sigmoid is 1.0f, also after texture levels are resampled.
inline constexpr float kOpaqueLogit = 30.0f;
/// Number of samples in the pool of logits that `table` describes.
std::uint64_t source_samples(std::span<const soup::TextureEntry> table);
/// A buffer of the logits of triangles `own`, laid out as in `table`. write(t, to) fills in those of triangle t, all
/// levels; they are zero before.
gpu::Buffer upload_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table, TriangleRange own,
                          const std::function<void(std::size_t, float*)>& write);
inline TriangleRange all_of(std::span<const soup::TextureEntry> table) {
  return {0, static_cast<std::uint32_t>(table.size())};
}
/// Initial textures of triangles `own`. opacities: one logit per triangle. colours: of the corners, 3 per triangle,
/// 0..1, which textures interpolate; empty: all features are zero.
gpu::Buffer initial_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table,
                           std::span<const glm::vec3> colours, std::span<const float> opacities,
                           TriangleRange own = {0, ~0u});

/// Allocates everything but the MLP. If the soup is shared, textures are those of own triangles only. Uploads the
/// vertices; their moments and all gradients are zero. Lattices and opacities are undefined until Step::sum_textures().
void allocate_soup(gpu::Device& gpu, SoupBuffers& soup, std::span<const glm::vec3> vertices,
                   std::vector<soup::TextureEntry> table, Textures textures = {});
void allocate_mlp(gpu::Device& gpu, SoupBuffers& soup, const soup::Mlp& mlp);

/// Shows all triangles, also those whose opacities are below the threshold, until Step::sum_textures().
void make_opaque(gpu::Device& gpu, SoupBuffers& soup);

/// Sets the sums to zero. Low words become kFixedZero, not 0.
void clear(gpu::Device& gpu, const FixedSums& sums);

/// A random MLP: He-uniform hidden layers, Xavier-uniform last layer, biases 0, as in the published release.
soup::Mlp initial_mlp(std::uint64_t seed);

}  // namespace trisoup::train
