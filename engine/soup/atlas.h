// Lattice textures as ordinary images: two triangles of one level share a block, each a right triangle of texels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "soup/soup.h"

namespace trisoup::soup {

/// Where a triangle's lattice lies. Lattice point (x, y) is the texel (x0 + x, y0 + y), or (x0 - x, y0 - y) if it is turned.
struct AtlasPlace {
  std::uint16_t x0 = 0, y0 = 0;
  std::uint8_t level = 0, page = 0, turned = 0, pad = 0;
};

struct Atlas {
  std::vector<glm::ivec2> pages;     // width, height in texels
  std::vector<AtlasPlace> places;    // per triangle
};

/// Largest side of a page, in texels: what every GPU of this decade takes.
inline constexpr int kAtlasSide = 8192;

/// Places one lattice per element of `levels` (each 0..kMaxLevel). A block of level R is (r + 3) x (r + 2) texels, r = 2^R: between
/// its two triangles, along the diagonal, each has one line of texels of its own, so that bilinear sampling never reads the other.
/// Throws Error when more than 255 pages would be needed.
Atlas make_atlas(std::span<const std::uint32_t> levels);

/// Texel of lattice point (x, y); x + y = r + 1 gives the gutter.
glm::ivec2 atlas_texel(const AtlasPlace& place, int x, int y);

/// Texture coordinates (0..1, v down) of a triangle's three vertices: centres of the texels of its corner lattice points.
/// Linear interpolation between them hits the texel centre of every lattice point.
void atlas_uv(const AtlasPlace& place, const glm::ivec2& page, glm::vec2 uv[3]);

/// Calls f(x, y, sx, sy) for every gutter texel (x, y) of a lattice with the lattice point (sx, sy) it repeats.
template <typename F>
void each_gutter_texel(std::uint32_t level, F&& f) {
  const int r = 1 << level;
  for (int y = 0; y <= r + 1; ++y) {
    const int x = r + 1 - y;
    if (x > 0) f(x, y, x - 1, y);
    else f(x, y, x, y - 1);
  }
}

}  // namespace trisoup::soup
