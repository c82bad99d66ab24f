// Packs lattice textures into images. Two triangles of equal level share a block; each covers a right triangle of
// texels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "common/host.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Position of a triangle's lattice in an atlas. Lattice point (x, y) is texel (x0 + x, y0 + y), or (x0 - x, y0 - y) if
/// turned.
struct AtlasPlace {
  std::uint16_t x0 = 0, y0 = 0;
  std::uint8_t level = 0, page = 0, turned = 0, pad = 0;
};

struct Atlas {
  std::vector<glm::ivec2> pages;   // width, height in texels
  std::vector<AtlasPlace> places;  // per triangle
};

/// Largest width and height of a page, in texels. Current GPUs support this size.
inline constexpr int kAtlasSide = 8192;
/// Smallest side that make_atlas() accepts; larger than the block of the highest level.
inline constexpr int kMinAtlasSide = 512;
/// Highest lattice level that an atlas accepts. Models use at most kMaxLevel.
inline constexpr std::uint32_t kMaxAtlasLevel = 8;

/// Places one lattice per element of `levels` (each 0..kMaxAtlasLevel) on pages of at most `side` x `side` texels. A
/// block of level R is (r + 3) x (r + 2) texels, r = 2^R. Along the diagonal, each of its two triangles has a line of
/// gutter texels, so bilinear sampling never reads the other triangle. Throws Error if a level is higher, if `side` is
/// outside kMinAtlasSide..kAtlasSide, or if more than 256 pages would be needed.
Atlas make_atlas(std::span<const std::uint32_t> levels, int side = kAtlasSide);

/// Width and height in texels of a block of two lattices of this level.
glm::ivec2 atlas_block(std::uint32_t level);

/// Texel of lattice point (x, y). Points with x + y = r + 1 are gutter texels.
glm::ivec2 atlas_texel(const AtlasPlace& place, int x, int y);

/// Texture coordinates (0..1, v down) of a triangle's three vertices: the centres of the texels of its corner lattice
/// points. Linear interpolation between them hits the texel centre of every lattice point.
void atlas_uv(const AtlasPlace& place, const glm::ivec2& page, glm::vec2 uv[3]);

/// Calls f(x, y, index) for every point of a lattice. index: position of the sample in the lattice.
template <typename F>
void each_lattice_point(std::uint32_t level, F&& f) {
  const int r = 1 << level;
  for (int y = 0; y <= r; ++y)
    for (int x = 0; x + y <= r; ++x) f(x, y, f32::lattice_index(x, y));
}

/// A gutter texel beyond the diagonal, x + y = r + 1, and the lattice points it is extrapolated from: value = value(a)
/// + value(b) - value(c).
struct GutterTexel {
  glm::ivec2 at, a, b, c;
};

/// Calls f(const GutterTexel&) for every gutter texel of a lattice. A gutter texel extends the plane through the three
/// points of the last cell, so that bilinear sampling is linear there, like the lattice. The two ends of the gutter
/// repeat their neighbour.
template <typename F>
void each_gutter_texel(std::uint32_t level, F&& f) {
  const int r = 1 << level;
  f(GutterTexel{{r + 1, 0}, {r, 0}, {r, 0}, {r, 0}});
  for (int y = 1; y <= r; ++y) {
    const int x = r + 1 - y;
    f(GutterTexel{{x, y}, {x, y - 1}, {x - 1, y}, {x - 1, y - 1}});
  }
  f(GutterTexel{{0, r + 1}, {0, r}, {0, r}, {0, r}});
}

/// The lattice points between which bilinear sampling of an atlas interpolates, and their weights: a square's lowest
/// point, the next ones along x and y, and the opposite one, which is missing along the diagonal.
struct AtlasWeights {
  std::array<std::uint32_t, 4> index{};  // positions in the lattice
  std::array<float, 4> weight{};
  std::size_t samples = 4;

  /// b0, b1: barycentric coordinates of vertices 0 and 1.
  AtlasWeights(float b0, float b1, std::uint32_t level);

  /// values: of the lattice.
  glm::vec3 mix(const glm::vec3* values) const {
    glm::vec3 sum(0.0f);
    for (std::size_t k = 0; k < samples; ++k) sum += weight[k] * values[index[k]];
    return sum;
  }
};

}  // namespace trisoup::soup
