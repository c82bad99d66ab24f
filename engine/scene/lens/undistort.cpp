#include "scene/lens/undistort.h"

#include <optional>

#include "scene/lens/sample.h"

namespace trisoup::scene {
namespace {

/// Finds where a camera with a lens shows a ray.
class LensMap {
 public:
  LensMap(const Camera& camera, const Lens& lens)
      : lens_(lens),
        focal_(camera.fx, camera.fy),
        principal_(camera.cx, camera.cy),
        size_(camera.width, camera.height) {
    const glm::dvec2 farthest = glm::max(glm::abs(principal_), glm::abs(size_ - principal_)) / focal_;
    limit_ = lens.growing_until(glm::length(farthest));
  }

  /// ray: (x, y, 1). Returns nullopt outside the picture.
  std::optional<glm::dvec2> shown(const glm::dvec2& ray) const {
    if (glm::length(ray) > limit_) return std::nullopt;
    const glm::dvec2 source = lens_.distort(ray) * focal_ + principal_;
    // Written so that NaN counts as outside.
    const bool inside = source.x >= 0 && source.y >= 0 && source.x <= size_.x && source.y <= size_.y;
    return inside ? std::optional(source) : std::nullopt;
  }

 private:
  const Lens& lens_;
  glm::dvec2 focal_, principal_, size_;
  double limit_ = 0;
};

glm::dvec2 ray_of_pixel(const Camera& camera, int x, int y) {
  return {(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy};
}

}  // namespace

Photograph undistort(const Photograph& photograph, const Camera& camera, const Lens& lens) {
  if (lens.is_pinhole()) return photograph;
  const LensMap source(resized(camera, photograph.width, photograph.height), lens);
  return resample(photograph, photograph.width, photograph.height, Border::clamped,
                  [&](int x, int y) { return source.shown(ray_of_pixel(camera, x, y)); });
}

ValueMap undistort(const ValueMap& map, const Camera& camera, const Lens& lens, const Camera& pinhole) {
  const LensMap source(resized(camera, map.width, map.height), lens);
  ValueMap result{pinhole.width, pinhole.height, map.numbers, {}};
  result.values.reserve(std::size_t(result.width) * std::size_t(result.height));
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x) {
      const auto at = source.shown(ray_of_pixel(pinhole, x, y));
      const int i = at ? std::min(map.width - 1, static_cast<int>(at->x)) : 0,
                j = at ? std::min(map.height - 1, static_cast<int>(at->y)) : 0;
      result.values.push_back(at ? map.values[std::size_t(j) * std::size_t(map.width) + std::size_t(i)] : 0.0f);
    }
  return result;
}

}  // namespace trisoup::scene
