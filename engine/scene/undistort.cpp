#include "scene/undistort.h"

#include <algorithm>
#include <cmath>

namespace trisoup::scene {
namespace {

struct Sample {
  glm::vec4 colour{0.0f};
  float inside = 0;  // total weight of the pixels in the loss
};

// Samples bilinearly between pixel centres, clamped at the border. If any of the four pixels are in the loss, only
// those contribute colour.
Sample sample(const Photograph& photograph, glm::dvec2 position) {
  const int width = photograph.width, height = photograph.height;
  const glm::dvec2 from_centre = position - 0.5, corner = glm::floor(from_centre);
  const glm::vec2 fraction(from_centre - corner);
  Sample result;
  glm::vec4 all(0.0f);
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx) {
      const int x = std::clamp(int(corner.x) + dx, 0, width - 1), y = std::clamp(int(corner.y) + dy, 0, height - 1);
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

Photograph undistort(const Photograph& photograph, const Camera& camera, const Lens& lens) {
  if (lens.is_pinhole()) return photograph;
  const glm::dvec2 focal(camera.fx, camera.fy), principal(camera.cx, camera.cy),
      size(photograph.width, photograph.height);
  const glm::dvec2 farthest = glm::max(glm::abs(principal), glm::abs(size - principal)) / focal;
  const double limit = lens.growing_until(glm::length(farthest));

  Photograph result{photograph.width, photograph.height, {}, {}};
  result.colour.assign(result.pixels(), glm::u8vec4(0));
  result.inside.assign(result.pixels(), 0);
  std::size_t i = 0;
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x, ++i) {
      const glm::dvec2 ray = (glm::dvec2(x + 0.5, y + 0.5) - principal) / focal;
      if (glm::length(ray) > limit) continue;
      const glm::dvec2 source = lens.distort(ray) * focal + principal;
      // Written so that NaN counts as outside.
      if (!(source.x >= 0 && source.y >= 0 && source.x <= size.x && source.y <= size.y)) continue;
      const Sample found = sample(photograph, source);
      result.colour[i] = glm::u8vec4(glm::min(found.colour + 0.5f, 255.0f));
      result.inside[i] = found.inside >= 0.5f ? 255 : 0;
    }
  if (std::all_of(result.inside.begin(), result.inside.end(), [](std::uint8_t a) { return a == 255; }))
    result.inside.clear();
  return result;
}

}  // namespace trisoup::scene
