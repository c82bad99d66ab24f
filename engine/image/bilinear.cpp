#include "image/bilinear.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.h"

namespace trisoup {
namespace {

/// The two source pixels of a target pixel along one axis, and the weight of the second one in 1/256.
struct Place {
  std::uint32_t before, after;
  std::uint16_t weight;
};
std::vector<Place> places(std::uint32_t from, std::uint32_t to) {
  std::vector<Place> all(to);
  for (std::uint32_t i = 0; i < to; ++i) {
    const double at = std::clamp((i + 0.5) * from / to - 0.5, 0.0, from - 1.0), before = std::floor(at);
    all[i].before = static_cast<std::uint32_t>(before);
    all[i].after = std::min(all[i].before + 1, from - 1);
    all[i].weight = static_cast<std::uint16_t>(std::lround(256 * (at - before)));
  }
  return all;
}

/// Uses 16-bit arithmetic so that compilers can vectorise loops over it.
constexpr std::uint8_t mix(std::uint8_t a, std::uint8_t b, std::uint16_t weight) {
  return static_cast<std::uint8_t>(static_cast<std::uint16_t>(a * (256 - weight) + b * weight + 128) >> 8);
}

}  // namespace

void scale_bilinear(const Pixels& from, std::span<std::uint8_t> to, std::uint32_t width, std::uint32_t height,
                    bool swap_red_blue) {
  if (from.width == 0 || from.height == 0 || from.bytes.size() != 4ull * from.width * from.height ||
      to.size() != 4ull * width * height)
    throw Error("bilinear scaling: {} and {} bytes do not match {} x {} and {} x {} pixels; report this as a bug",
                from.bytes.size(), to.size(), from.width, from.height, width, height);
  const std::vector<Place> columns = places(from.width, width), lines = places(from.height, height);
  const std::size_t bytes = 4ull * width;
  // The two source rows of the current line, scaled to the target width. Lines are visited in order, so each row is
  // computed once.
  struct Row {
    std::uint32_t line;
    std::vector<std::uint8_t> pixels;
  } above{~0u, std::vector<std::uint8_t>(bytes)}, below = above;
  const auto fill = [&](Row& row, std::uint32_t line) {
    if (row.line == line) return;
    const std::uint8_t* source = &from.bytes[4ull * from.width * line];
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::uint8_t *a = source + 4 * columns[x].before, *b = source + 4 * columns[x].after;
      for (std::uint32_t c = 0; c < 4; ++c) row.pixels[4ull * x + c] = mix(a[c], b[c], columns[x].weight);
      if (swap_red_blue) std::swap(row.pixels[4ull * x], row.pixels[4ull * x + 2]);
    }
    row.line = line;
  };
  for (std::uint32_t y = 0; y < height; ++y) {
    if (below.line == lines[y].before) std::swap(above, below);
    fill(above, lines[y].before);
    fill(below, lines[y].after);
    const std::uint8_t *a = above.pixels.data(), *b = below.pixels.data();
    std::uint8_t* line = &to[bytes * y];
    const std::uint16_t weight = lines[y].weight;
    for (std::size_t i = 0; i < bytes; ++i) line[i] = mix(a[i], b[i], weight);
  }
}

}  // namespace trisoup
