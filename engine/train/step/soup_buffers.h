// A soup, its optimiser state and its gradients in device memory.
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
  std::uint32_t samples = 0;  // of all levels; none of these textures has more
};

struct SoupBuffers {
  std::uint32_t triangles = 0;
  std::vector<soup::TextureEntry> table;  // as on the device, where all of it is here
  std::uint64_t source_samples = 0, lattice_samples = 0;
  std::uint32_t level_max = 0;  // over all triangles
  bool drop_near = false;       // as published: what reaches the camera plane is dropped whole, not clipped
  SoupPartition* partition = &whole_soup();
  std::vector<TriangleRange> ranges;  // triangles of each rank. [ranks]

  /// Triangles whose textures are here.
  TriangleRange own() const;
  /// The first of a triangle's samples of all levels, or of its lattice; of `triangles`: how many there are.
  std::uint64_t source_at(std::uint32_t triangle) const {
    return triangle < triangles ? table[triangle].source_offset : source_samples;
  }
  std::uint64_t lattice_at(std::uint32_t triangle) const {
    return triangle < triangles ? table[triangle].lattice_offset : lattice_samples;
  }

  gpu::Buffer vertices, vertex_moment1, vertex_moment2;  // [T][3][3], [3T][3], [3T]
  FixedSums vertex_gradient;                             // [T][3][3]
  gpu::Buffer textures;                                  // [T] Texture: local_rows()
  gpu::Buffer tasks;                                     // [own] TextureTask, by class
  std::vector<TextureClass> classes;                     // small textures first
  gpu::Buffer source, source_moment1,
      source_moment2;                         // [source samples][8], logits; of own triangles, as the next three
  gpu::Buffer lattice, opacity;               // [lattice samples][8], [lattice samples], after the sigmoid
  FixedSums opacity_gradient;                 // [lattice samples]; those of the features: BatchBuffers::sorted
  gpu::Buffer touched;                        // [T] 0 where opacity_gradient is known to be zero
  gpu::Buffer mlp, mlp_moment1, mlp_moment2;  // [595]
};

/// Bytes of textures of so many samples in all levels and in the finest ones, with their opacities, moments and
/// gradients: what ranks divide.
constexpr std::uint64_t texture_bytes(std::uint64_t source_samples, std::uint64_t lattice_samples) {
  return source_samples * 3 * soup::kChannels * 4 + lattice_samples * (soup::kChannels * 4 + 12);
}
/// Bytes of vertices, their moments and gradients, the texture table and what else there is of every triangle on every
/// rank.
constexpr std::uint64_t triangle_bytes(std::uint64_t triangles) {
  return triangles * (36 + 36 + 12 + 72 + 4 + 2 * sizeof(soup::TextureEntry));
}
/// Bytes of device memory that a soup of `triangles` with levels level_min..level_max takes, gradients and moments
/// included, on one of `ranks` ranks.
std::uint64_t soup_bytes(std::uint64_t triangles, std::uint32_t level_min, std::uint32_t level_max,
                         std::uint32_t ranks = 1);

/// The rows of `table` for pools that begin with the first sample of `own`; those of other triangles have their levels,
/// and offsets of 0, since lanes of a CPU read where they take no part too.
std::vector<soup::TextureEntry> local_rows(std::span<const soup::TextureEntry> table, TriangleRange own);

/// Textures that a soup begins with, of own triangles: logits and moments, each zero where there is no buffer.
struct Textures {
  gpu::Buffer source, moment1, moment2;
};

/// A logit whose sigmoid is 1.0f, however levels are resampled.
inline constexpr float kOpaqueLogit = 30.0f;
/// Size of the pool of logits that a table describes.
std::uint64_t source_samples(std::span<const soup::TextureEntry> table);
/// A buffer of logits laid out as `table`, of triangles `own`: write(t, to) writes those of triangle t, all its levels,
/// which are zero before.
gpu::Buffer upload_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table, TriangleRange own,
                          const std::function<void(std::size_t, float*)>& write);
inline TriangleRange all_of(std::span<const soup::TextureEntry> table) {
  return {0, static_cast<std::uint32_t>(table.size())};
}
/// Logits of textures that have one opacity everywhere (a logit for each triangle), and show the mixture of their
/// corners' colours (3 for each triangle, 0..1; empty: all features are zero).
gpu::Buffer initial_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table,
                           std::span<const glm::vec3> colours, std::span<const float> opacities,
                           TriangleRange own = {0, ~0u});

/// Allocates everything but the MLP, as much of it as SoupBuffers::partition has here; vertices are
/// uploaded, their moments are zero, gradients empty. The lattices are undefined until the levels are summed
/// (Step::sum_textures).
void allocate_soup(gpu::Device& gpu, SoupBuffers& soup, std::span<const glm::vec3> vertices,
                   std::vector<soup::TextureEntry> table, Textures textures = {});
void allocate_mlp(gpu::Device& gpu, SoupBuffers& soup, const soup::Mlp& mlp);

/// Sets the sums to zero, which in fixed point is not all bits zero.
void clear(gpu::Device& gpu, const FixedSums& sums);

/// The MLP at the start: He-uniform hidden layers, Xavier-uniform last one, biases 0, as the published release does.
soup::Mlp initial_mlp(std::uint64_t seed);

}  // namespace trisoup::train
