// A soup, its optimiser state and its gradients in device memory.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "soup/soup.h"

namespace trisoup::train {

/// Gradients are sums in 64-bit fixed point (shaders/common/fixed_point.h): low words and high words.
struct FixedSums {
  gpu::Buffer low, high;
};

struct SoupBuffers {
  std::uint32_t triangles = 0;
  std::vector<soup::TextureEntry> table;  // as on the device
  std::uint64_t source_samples = 0, lattice_samples = 0;
  std::uint32_t level_max = 0;  // over all triangles
  bool drop_near = false;       // as published: what reaches the camera plane is dropped whole, not clipped

  gpu::Buffer vertices, vertex_moment1, vertex_moment2;  // [T][3][3], [3T][3], [3T]
  FixedSums vertex_gradient;                             // [T][3][3]
  gpu::Buffer textures;                                  // [T] Texture
  gpu::Buffer source, source_moment1, source_moment2;    // [source samples][8], logits
  gpu::Buffer lattice, opacity;                          // [lattice samples][8], [lattice samples], after the sigmoid
  FixedSums opacity_gradient;                            // [lattice samples]; those of the features: Frame::sorted
  gpu::Buffer touched;                                   // [T] 0 where opacity_gradient is known to be zero
  gpu::Buffer mlp, mlp_moment1, mlp_moment2;             // [595]
};

/// Bytes of device memory that a soup of `triangles` with levels level_min..level_max takes, gradients and moments included.
std::uint64_t soup_bytes(std::uint64_t triangles, std::uint32_t level_min, std::uint32_t level_max);

/// Textures that a soup begins with: logits and moments, each zero where there is no buffer.
struct Textures {
  gpu::Buffer source, moment1, moment2;
};

/// A logit whose sigmoid is 1.0f, however levels are resampled.
inline constexpr float kOpaqueLogit = 30.0f;
/// Size of the pool of logits that a table describes.
std::uint64_t source_samples(std::span<const soup::TextureEntry> table);
/// A buffer of logits laid out as `table`: write(t, to) writes those of triangle t, all its levels, which are zero before.
gpu::Buffer upload_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table, const std::function<void(std::size_t, float*)>& write);
/// Logits of textures that have one opacity everywhere (a logit for each triangle), and show the mixture of their corners' colours (3 for
/// each triangle, 0..1; empty: all features are zero).
gpu::Buffer initial_logits(gpu::Device& gpu, std::span<const soup::TextureEntry> table, std::span<const glm::vec3> colours,
                           std::span<const float> opacities);

/// Allocates everything but the MLP; vertices are uploaded, their moments are zero, gradients empty. The lattices are undefined until the levels are summed (Step::sum_textures).
void allocate_soup(gpu::Device& gpu, SoupBuffers& soup, std::span<const glm::vec3> vertices,
                   std::vector<soup::TextureEntry> table, Textures textures = {});
void allocate_mlp(gpu::Device& gpu, SoupBuffers& soup, const soup::Mlp& mlp);

/// Sets the sums to zero, which in fixed point is not all bits zero.
void clear(gpu::Device& gpu, const FixedSums& sums);

/// The MLP at the start: He-uniform hidden layers, Xavier-uniform last one, biases 0, as the published release does.
soup::Mlp initial_mlp(std::uint64_t seed);

}  // namespace trisoup::train
