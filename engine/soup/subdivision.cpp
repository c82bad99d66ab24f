#include "soup/subdivision.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <utility>

namespace trisoup::soup {
namespace {

struct Edge {
  float length_squared;
  std::uint32_t face;
  int index;  // edge k connects corners k and (k + 1) % 3
  std::uint32_t generation;
  bool operator<(const Edge& other) const { return length_squared < other.length_squared; }
};

Subdivision unchanged(std::span<const glm::vec3> vertices) {
  Subdivision soup;
  soup.vertices.assign(vertices.begin(), vertices.end());
  soup.face_map.resize(vertices.size() / 3);
  std::iota(soup.face_map.begin(), soup.face_map.end(), 0u);
  soup.corners.assign(soup.face_map.size(), kWholeParent);
  return soup;
}

/// Splits a triangle at fraction `t` of edge `index`. One half replaces the triangle, the other is appended.
void halve(Subdivision& soup, std::uint32_t face, int index, float t) {
  const std::size_t first = 3 * std::size_t{face};
  const std::size_t k[3] = {static_cast<std::size_t>(index), static_cast<std::size_t>((index + 1) % 3),
                            static_cast<std::size_t>((index + 2) % 3)};
  const glm::vec3 va = soup.vertices[first + k[0]], vb = soup.vertices[first + k[1]], vc = soup.vertices[first + k[2]];
  const Corners parent = soup.corners[face];
  const glm::vec3 ba = parent[k[0]], bb = parent[k[1]], bc = parent[k[2]];
  const glm::vec3 middle = (1.0f - t) * va + t * vb;
  const glm::vec3 bm = (1.0f - t) * ba + t * bb;
  soup.vertices[first] = va, soup.vertices[first + 1] = middle, soup.vertices[first + 2] = vc;
  soup.corners[face] = {ba, bm, bc};
  soup.vertices.insert(soup.vertices.end(), {middle, vb, vc});
  soup.corners.push_back({bm, bb, bc});
  soup.face_map.push_back(soup.face_map[face]);
}

// Longest-edge bisection with a metric: metric(p, q) is the squared length of an edge, 0 if it must not be split;
// cut(p, q) is the fraction from p to q at which it is split.
//
// The order of equal lengths (both halves of an edge, the median they share) decides which triangle gets which index.
// It is the order of libstdc++'s binary heap for exactly this sequence of pushes, as in the published release. Another
// standard library gives an equally good soup in another order.
template <typename Metric, typename Cut>
void bisect(Subdivision& soup, std::vector<std::uint8_t> marked, float threshold_squared, std::size_t max_splits,
            Metric&& metric, Cut&& cut) {
  std::vector<std::uint32_t> generation(soup.triangles(), 0);
  std::priority_queue<Edge> longest;
  const auto push = [&](std::uint32_t face) {
    for (int k = 0; k < 3; ++k) {
      const float length = metric(soup.vertices[3 * face + k], soup.vertices[3 * face + (k + 1) % 3]);
      // Skips edges with length 0, infinite edges, which bisection cannot shorten, and NaN, which has no order.
      if (length > 0.0f && std::isfinite(length)) longest.push({length, face, k, generation[face]});
    }
  };
  for (std::uint32_t face = 0; face < soup.triangles(); ++face)
    if (marked.empty() || marked[face]) push(face);

  for (std::size_t splits = 0; splits < max_splits && !longest.empty();) {
    const Edge edge = longest.top();
    longest.pop();
    if (edge.generation != generation[edge.face]) continue;  // stale entry: the triangle has been split since
    if (edge.length_squared <= threshold_squared) break;

    const auto place = static_cast<std::uint32_t>(soup.triangles());
    const std::size_t first = 3 * std::size_t{edge.face};
    halve(soup, edge.face, edge.index,
          cut(soup.vertices[first + edge.index], soup.vertices[first + (edge.index + 1) % 3]));
    ++generation[edge.face];
    generation.push_back(0);
    push(edge.face);
    push(place);
    ++splits;
  }
}

float world_length_squared(const glm::vec3& p, const glm::vec3& q) {
  const glm::vec3 d = q - p;
  return d.x * d.x + d.y * d.y + d.z * d.z;
}

// Sums from left to right, regardless of the order in GLM's product. The two halves of an edge are equally long on
// screen except for rounding, so the order of bisections depends on the last bit of these operations.
glm::vec4 to_clip(const glm::mat4& m, const glm::vec3& p) { return ((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3]; }

constexpr auto kMidpoint = [](const glm::vec3&, const glm::vec3&) { return 0.5f; };

void bisect_on_screen_in_place(Subdivision& soup, const ScreenView& view, float fraction,
                               std::span<const std::uint8_t> marked, std::size_t max_splits) {
  const float aspect = static_cast<float>(view.width) / static_cast<float>(view.height);
  const auto metric = [&](const glm::vec3& p, const glm::vec3& q) {
    glm::vec3 ndc[2];
    int k = 0;
    for (const glm::vec3& end : {p, q}) {
      const glm::vec4 clip = to_clip(view.clip, end);
      if (!(clip.w > 0.0f)) return 0.0f;
      ndc[k] = glm::vec3(clip) / clip.w;
      if (!(std::abs(ndc[k].x) <= 1.0f && std::abs(ndc[k].y) <= 1.0f && std::abs(ndc[k].z) <= 1.0f)) return 0.0f;
      ++k;
    }
    const float dx = (ndc[1].x - ndc[0].x) * aspect, dy = ndc[1].y - ndc[0].y;
    return dx * dx + dy * dy;
  };
  // Returns the t at which (1 - t) p + t q projects to the midpoint m of the projections: t (d.xy - m d.w) = m p.w -
  // p.xy in clip space, with d = q - p. In exact arithmetic t = p.w / (p.w + q.w). This least-squares form is used
  // because its rounding determines the published order.
  const auto cut = [&](const glm::vec3& p, const glm::vec3& q) {
    const glm::vec4 cp = to_clip(view.clip, p), cq = to_clip(view.clip, q);
    const glm::vec2 middle = 0.5f * (glm::vec2(cp) / cp.w + glm::vec2(cq) / cq.w);
    const glm::vec2 along = glm::vec2(cq - cp) - middle * (cq.w - cp.w), offset = middle * cp.w - glm::vec2(cp);
    const float t = (offset.x * along.x + offset.y * along.y) / (along.x * along.x + along.y * along.y);
    return t > 0.0f && t < 1.0f ? t : 0.5f;
  };
  const float threshold = 2.0f * fraction;  // NDC has height 2
  bisect(soup, {marked.begin(), marked.end()}, threshold * threshold, max_splits, metric, cut);
}

}  // namespace

std::vector<std::uint32_t> most_visible(std::span<const std::uint32_t> counts, std::size_t budget) {
  std::vector<std::uint32_t> order(counts.size());
  std::iota(order.begin(), order.end(), 0u);
  if (counts.size() <= budget) return order;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return counts[a] < counts[b]; });
  order.erase(order.begin(), order.end() - static_cast<std::ptrdiff_t>(budget));
  std::sort(order.begin(), order.end());
  return order;
}

std::vector<std::uint32_t> visible_at_least(std::span<const std::uint32_t> counts, std::uint32_t threshold) {
  std::vector<std::uint32_t> kept;
  for (std::uint32_t face = 0; face < counts.size(); ++face)
    if (counts[face] >= threshold) kept.push_back(face);
  return kept;
}

Subdivision keep(std::span<const glm::vec3> vertices, std::span<const std::uint32_t> kept) {
  Subdivision soup;
  soup.face_map.assign(kept.begin(), kept.end());
  soup.corners.assign(kept.size(), kWholeParent);
  soup.vertices.reserve(3 * kept.size());
  for (const std::uint32_t face : kept)
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(vertices[3 * std::size_t{face} + k]);
  return soup;
}

Subdivision bisect_longest(std::span<const glm::vec3> vertices, std::size_t target) {
  Subdivision soup = unchanged(vertices);
  if (target > soup.triangles()) bisect(soup, {}, 0.0f, target - soup.triangles(), world_length_squared, kMidpoint);
  return soup;
}

Subdivision bisect_longer_than(std::span<const glm::vec3> vertices, float longest,
                               std::optional<std::size_t> max_splits) {
  Subdivision soup = unchanged(vertices);
  bisect(soup, {}, longest * longest, max_splits.value_or(SIZE_MAX), world_length_squared, kMidpoint);
  return soup;
}

Subdivision bisect_on_screen(std::span<const glm::vec3> vertices, const ScreenView& view, float fraction,
                             std::span<const std::uint8_t> marked, std::optional<std::size_t> max_splits) {
  Subdivision soup = unchanged(vertices);
  bisect_on_screen_in_place(soup, view, fraction, marked, max_splits.value_or(SIZE_MAX));
  return soup;
}

Subdivision bisect_on_screens(std::span<const glm::vec3> vertices, std::span<const ScreenView> views, float fraction,
                              std::span<const std::vector<std::uint8_t>> visible,
                              std::optional<std::size_t> max_splits) {
  Subdivision soup = unchanged(vertices);
  std::size_t left = max_splits.value_or(SIZE_MAX);
  for (std::size_t view = 0; view < views.size() && left > 0; ++view) {
    const std::size_t before = soup.triangles();
    std::vector<std::uint8_t> marked(before);
    for (std::size_t face = 0; face < before; ++face) marked[face] = visible[view][soup.face_map[face]];
    bisect_on_screen_in_place(soup, views[view], fraction, marked, left);
    left -= soup.triangles() - before;
  }
  return soup;
}

Subdivision bisect_largest(std::span<const glm::vec3> vertices, std::span<const double> sizes, double smallest,
                           std::size_t target) {
  Subdivision soup = unchanged(vertices);
  // Ties: the first index.
  const auto after = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  std::priority_queue<std::pair<double, std::uint32_t>, std::vector<std::pair<double, std::uint32_t>>, decltype(after)>
      largest(after);
  const auto push = [&](double size, std::uint32_t face) {
    if (size >= 2 * smallest && std::isfinite(size)) largest.push({size, face});
  };
  for (std::uint32_t face = 0; face < soup.triangles(); ++face) push(sizes[face], face);
  while (soup.triangles() < target && !largest.empty()) {
    const auto [size, face] = largest.top();
    largest.pop();
    const std::size_t first = 3 * std::size_t{face};
    int longest = 0;
    float length = 0;
    for (int k = 0; k < 3; ++k) {
      const float l = world_length_squared(soup.vertices[first + k], soup.vertices[first + (k + 1) % 3]);
      if (l > length) length = l, longest = k;
    }
    if (!(length > 0 && std::isfinite(length))) continue;
    const auto place = static_cast<std::uint32_t>(soup.triangles());
    halve(soup, face, longest, 0.5f);
    push(0.5 * size, face);
    push(0.5 * size, place);
  }
  return soup;
}

Subdivision compose(const Subdivision& first, Subdivision second) {
  for (std::size_t face = 0; face < second.triangles(); ++face) {
    const std::uint32_t middle = second.face_map[face];
    for (glm::vec3& corner : second.corners[face]) {
      const Corners& parent = first.corners[middle];
      corner = corner.x * parent[0] + corner.y * parent[1] + corner.z * parent[2];
    }
    second.face_map[face] = first.face_map[middle];
  }
  return second;
}

}  // namespace trisoup::soup
