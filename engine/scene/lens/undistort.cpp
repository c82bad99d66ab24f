#include "scene/lens/undistort.h"

#include "scene/lens/sample.h"

namespace trisoup::scene {

Photograph undistort(const Photograph& photograph, const Camera& camera, const Lens& lens) {
  if (lens.is_pinhole()) return photograph;
  const glm::dvec2 focal(camera.fx, camera.fy), principal(camera.cx, camera.cy),
      size(photograph.width, photograph.height);
  const glm::dvec2 farthest = glm::max(glm::abs(principal), glm::abs(size - principal)) / focal;
  const double limit = lens.growing_until(glm::length(farthest));
  return resample(photograph, photograph.width, photograph.height, Border::clamped,
                  [&](int x, int y) -> std::optional<glm::dvec2> {
                    const glm::dvec2 ray = (glm::dvec2(x + 0.5, y + 0.5) - principal) / focal;
                    if (glm::length(ray) > limit) return std::nullopt;
                    const glm::dvec2 source = lens.distort(ray) * focal + principal;
                    // Written so that NaN counts as outside.
                    const bool inside = source.x >= 0 && source.y >= 0 && source.x <= size.x && source.y <= size.y;
                    return inside ? std::optional(source) : std::nullopt;
                  });
}

}  // namespace trisoup::scene
