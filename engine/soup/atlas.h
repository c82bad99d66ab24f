// Lattice textures as ordinary images: two triangles of one level share a block, each a right triangle of texels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "common/host.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Where a triangle's lattice lies. Lattice point (x, y) is the texel (x0 + x, y0 + y), or (x0 - x, y0 - y) if it is
/// turned.
struct AtlasPlace {
  std::uint16_t x0 = 0, y0 = 0;
  std::uint8_t level = 0, page = 0, turned = 0, pad = 0;
};

struct Atlas {
  std::vector<glm::ivec2> pages;   // width, height in texels
  std::vector<AtlasPlace> places;  // per triangle
};

/// Largest side of a page, in texels: what every GPU of this decade takes.
inline constexpr int kAtlasSide = 8192;
/// Smallest side that may be asked for: the block of the largest level and some more.
inline constexpr int kMinAtlasSide = 512;
/// Highest level of a lattice that has a place in an atlas. A Model ends at kMaxLevel already.
inline constexpr std::uint32_t kMaxAtlasLevel = 8;

/// Places one lattice per element of `levels` (each 0..kMaxAtlasLevel) on pages of at most `side` x `side` texels. A
/// block of level R is (r + 3) x (r + 2) texels, r = 2^R: between its two triangles, along the diagonal, each has one
/// line of texels of its own, so that bilinear sampling never reads the other. Throws Error on a higher level, on a
/// side outside kMinAtlasSide..kAtlasSide, and when more than 256 pages would be needed.
Atlas make_atlas(std::span<const std::uint32_t> levels, int side = kAtlasSide);

/// Width and height in texels of the block that two lattices of this level share.
glm::ivec2 atlas_block(std::uint32_t level);

/// Texel of lattice point (x, y); x + y = r + 1 gives the gutter.
glm::ivec2 atlas_texel(const AtlasPlace& place, int x, int y);

/// Texture coordinates (0..1, v down) of a triangle's three vertices: centres of the texels of its corner lattice
/// points. Linear interpolation between them hits the texel centre of every lattice point.
void atlas_uv(const AtlasPlace& place, const glm::ivec2& page, glm::vec2 uv[3]);

/// Calls f(x, y, index) for every point of a lattice with its index in the lattice.
template <typename F>
void each_lattice_point(std::uint32_t level, F&& f) {
  const int r = 1 << level;
  for (int y = 0; y <= r; ++y)
    for (int x = 0; x + y <= r; ++x) f(x, y, f32::lattice_index(x, y));
}

/// A texel beyond the diagonal, x + y = r + 1, and the lattice points it follows from: value = value(a) + value(b) -
/// value(c).
struct GutterTexel {
  glm::ivec2 at, a, b, c;
};

/// Calls f(const GutterTexel&) for every gutter texel of a lattice. It continues the plane through the three points of
/// the last cell, so that bilinear sampling is linear there, as the lattice is; the two ends of the gutter repeat their
/// neighbour.
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

}  // namespace trisoup::soup
