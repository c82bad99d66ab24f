#include "scene/lens/sample.h"

#include <algorithm>
#include <cmath>

namespace trisoup::scene {
namespace {

struct Sample {
  glm::vec4 colour{0.0f};
  float inside = 0;  // total weight of the pixels in the loss
};

// Samples bilinearly between pixel centres.
Sample sample(const Photograph& photograph, Border border, glm::dvec2 position) {
  const int width = photograph.width, height = photograph.height;
  if (border == Border::wrapped) position.x -= width * std::floor(position.x / width);
  const glm::dvec2 from_centre = position - 0.5, corner = glm::floor(from_centre);
  const glm::vec2 fraction(from_centre - corner);
  Sample result;
  glm::vec4 all(0.0f);
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const int column = int(corner.x) + dx;
      const int x = border == Border::wrapped ? (column + width) % width : std::clamp(column, 0, width - 1);
      const int y = std::clamp(int(corner.y) + dy, 0, height - 1);
      const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
      const float weight = (dx ? fraction.x : 1 - fraction.x) * (dy ? fraction.y : 1 - fraction.y);
      const glm::vec4 colour = weight * glm::vec4(photograph.colour[i]);
      all += colour;
      if (photograph.inside.empty() || photograph.inside[i] != 0) {
        result.colour += colour;
        result.inside += weight;
      }
    }
  result.colour = result.inside > 1e-6f ? result.colour / result.inside : all;
  return result;
}

}  // namespace

Photograph resample(const Photograph& photograph, int width, int height, Border border,
                    const std::function<std::optional<glm::dvec2>(int x, int y)>& source) {
  Photograph result{width, height, {}, {}};
  result.colour.assign(result.pixels(), glm::u8vec4(0));
  result.inside.assign(result.pixels(), 0);
  std::size_t i = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x, ++i) {
      const std::optional<glm::dvec2> position = source(x, y);
      if (!position) continue;
      const Sample found = sample(photograph, border, *position);
      result.colour[i] = glm::u8vec4(glm::min(found.colour + 0.5f, 255.0f));
      result.inside[i] = found.inside >= 0.5f ? 255 : 0;
    }
  if (std::all_of(result.inside.begin(), result.inside.end(), [](std::uint8_t a) { return a == 255; }))
    result.inside.clear();
  return result;
}

}  // namespace trisoup::scene
