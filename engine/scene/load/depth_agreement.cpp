#include "scene/load/depth_agreement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace trisoup::scene {
namespace {

constexpr double kAgreeingDepths = 0.03;  // largest relative difference of depths of one point
constexpr std::size_t kPointsOfMap = 150, kFewestCompared = 100, kOtherMaps = 8;

/// A point of one map, and another view that may show it.
struct Comparison {
  glm::dvec3 eye, ray;  // the point is eye + depth ray
  double inverse;       // inverse depth, as given
  const View* other;
};

/// Pixels of a map, evenly spread.
void add_comparisons(const View& view, std::span<const View* const> others, std::vector<Comparison>& all) {
  const MeasuredDepth& depth = view.depth;
  const Camera camera = resized(view.camera, depth.width, depth.height);
  const glm::dmat3 to_world = glm::transpose(glm::dmat3(camera.world_to_camera));
  const std::size_t step = 1 + depth.inverse.size() / kPointsOfMap;
  for (std::size_t pixel = step / 2; pixel < depth.inverse.size(); pixel += step) {
    if (!(depth.inverse[pixel] > 0)) continue;
    const auto width = static_cast<std::size_t>(depth.width);
    const double x = static_cast<double>(pixel % width) + 0.5, y = static_cast<double>(pixel / width) + 0.5;
    const glm::dvec3 ray = to_world * glm::dvec3((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1);
    for (const View* other : others)
      if (other != &view) all.push_back({camera.centre(), ray, depth.inverse[pixel], other});
  }
}

/// Share of the comparisons in which the other map has the point, if all depths are multiplied. The nearer, the more
/// it counts, so that the largest share is in the middle of the factors that would do.
double share_agreeing(std::span<const Comparison> comparisons, double times) {
  std::size_t compared = 0;
  double agreeing = 0;
  for (const Comparison& c : comparisons) {
    const auto shown = shown_at(c.other->camera, c.eye + times / c.inverse * c.ray);
    if (!shown) continue;
    const MeasuredDepth& map = c.other->depth;
    const auto x = static_cast<std::size_t>(shown->pixel.x * map.width / c.other->camera.width),
               y = static_cast<std::size_t>(shown->pixel.y * map.height / c.other->camera.height);
    const double inverse = map.inverse[y * static_cast<std::size_t>(map.width) + x];
    if (!(inverse > 0)) continue;
    ++compared;
    agreeing += std::max(0.0, 1 - std::abs(times / (inverse * shown->depth) - 1) / kAgreeingDepths);
  }
  return compared < kFewestCompared ? 0 : agreeing / static_cast<double>(compared);
}

}  // namespace

DepthAgreement agreement_of_depths(std::span<const View> views) {
  std::vector<const View*> measured;
  for (const View& view : views)
    if (!view.depth.inverse.empty()) measured.push_back(&view);
  std::vector<Comparison> comparisons;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    std::vector<const View*> others;
    for (std::size_t k = 0; k < std::min(kOtherMaps, measured.size()); ++k)
      others.push_back(measured[(i + 1 + k * measured.size() / kOtherMaps) % measured.size()]);
    add_comparisons(*measured[i], others, comparisons);
  }
  DepthAgreement result;
  result.as_given = result.best = share_agreeing(comparisons, 1);
  const auto take_best = [&](double times) {
    if (const double share = share_agreeing(comparisons, times); share > result.best)
      result.best = share, result.times = times;
  };
  for (int i = -48; i <= 48; ++i) take_best(std::pow(10.0, i / 48.0));  // steps of 5 %
  const double coarse = result.times;
  for (int i = -5; i <= 5; ++i) take_best(coarse * (1 + 0.01 * i));
  return result;
}

}  // namespace trisoup::scene
