#include "soup/atlas.h"

#include <algorithm>
#include <numeric>

#include "base/error.h"

namespace trisoup::soup {
namespace {

/// Packs blocks into pages of `width` x at most `side` texels, row by row.
struct Shelves {
  int width, side, x = 0, y = 0, shelf = 0, page = 0;
  std::vector<int> heights{0};

  /// Returns the top left corner of a new block. Blocks must come in order of decreasing height.
  glm::ivec2 place(const glm::ivec2& block) {
    if (x + block.x > width) {
      y += shelf;
      x = 0;
      shelf = 0;
    }
    if (y + block.y > side) {
      ++page;
      heights.push_back(0);
      x = y = shelf = 0;
    }
    shelf = std::max(shelf, block.y);
    const glm::ivec2 corner(x, y);
    x += block.x;
    heights[page] = std::max(heights[page], y + block.y);
    return corner;
  }
};

}  // namespace

glm::ivec2 atlas_block(std::uint32_t level) {
  const int r = 1 << level;
  return {r + 3, r + 2};
}

Atlas make_atlas(std::span<const std::uint32_t> levels, int side) {
  if (side < kMinAtlasSide || side > kAtlasSide)
    throw Error("model: an atlas side of {} texels is not possible; use {} to {}", side, kMinAtlasSide, kAtlasSide);
  for (const std::uint32_t level : levels)
    if (level > kMaxAtlasLevel)
      throw Error("model: a texture of level {} does not fit in an atlas; use levels up to {}", level, kMaxAtlasLevel);
  std::vector<std::uint32_t> order(levels.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return levels[a] > levels[b]; });

  std::uint64_t area = 0;
  for (const std::uint32_t level : levels) {
    const glm::ivec2 block = atlas_block(level);
    area += static_cast<std::uint64_t>(block.x) * block.y / 2 + 1;
  }
  int width = 64;
  if (!levels.empty())
    while (width < atlas_block(levels[order[0]]).x) width *= 2;
  while (width * 2 <= side && static_cast<std::uint64_t>(width) * width < area + area / 16) width *= 2;

  Atlas atlas;
  atlas.places.resize(levels.size());
  Shelves shelves{width, side};
  for (std::size_t i = 0; i < order.size();) {
    const std::uint32_t level = levels[order[i]];
    const glm::ivec2 block = atlas_block(level), corner = shelves.place(block);
    if (shelves.page > 255)
      throw Error("model: its textures need more than 256 atlas pages; use fewer triangles or lower levels");
    for (int half = 0; half < 2 && i < order.size() && levels[order[i]] == level; ++half, ++i) {
      AtlasPlace& place = atlas.places[order[i]];
      place.x0 = static_cast<std::uint16_t>(half ? corner.x + block.x - 1 : corner.x);
      place.y0 = static_cast<std::uint16_t>(half ? corner.y + block.y - 1 : corner.y);
      place.level = static_cast<std::uint8_t>(level);
      place.page = static_cast<std::uint8_t>(shelves.page);
      place.turned = static_cast<std::uint8_t>(half);
    }
  }
  for (const int height : shelves.heights) atlas.pages.emplace_back(width, std::max(1, height));
  return atlas;
}

glm::ivec2 atlas_texel(const AtlasPlace& place, int x, int y) {
  return place.turned ? glm::ivec2(place.x0 - x, place.y0 - y) : glm::ivec2(place.x0 + x, place.y0 + y);
}

void atlas_uv(const AtlasPlace& place, const glm::ivec2& page, glm::vec2 uv[3]) {
  const int r = 1 << place.level;
  // Barycentric coordinates (x / r, y / r) belong to vertices 0 and 1.
  const glm::ivec2 corners[3] = {atlas_texel(place, r, 0), atlas_texel(place, 0, r), atlas_texel(place, 0, 0)};
  for (int k = 0; k < 3; ++k) uv[k] = (glm::vec2(corners[k]) + 0.5f) / glm::vec2(page);
}

AtlasWeights::AtlasWeights(float b0, float b1, std::uint32_t level) {
  const f32::LatticeSquare square = f32::lattice_square(b0, b1, level);
  const float u = std::clamp(square.fu, 0.0f, 1.0f), v = std::clamp(square.fv, 0.0f, 1.0f), uv = u * v;
  const std::uint32_t x = square.x, y = square.y;
  index = {f32::lattice_index(x, y), f32::lattice_index(x + 1, y), f32::lattice_index(x, y + 1), 0};
  if (f32::has_upper_half(square, level)) {
    index[3] = f32::lattice_index(x + 1, y + 1);
    weight = {1 - u - v + uv, u - uv, v - uv, uv};
  } else {
    // A gutter texel is the sum of its two neighbours minus the lowest point.
    samples = 3;
    weight = {1 - u - v, u, v, 0};
  }
}

}  // namespace trisoup::soup
