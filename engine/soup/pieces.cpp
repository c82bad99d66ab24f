#include "soup/pieces.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "mesh/triangle_distance.h"

namespace trisoup::soup {
namespace {

/// Sets of triangles that are merged step by step (union-find with path halving).
class MergedSets {
 public:
  explicit MergedSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void merge(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

struct Bounds {
  glm::vec3 low, high;
};

Bounds joined(const Bounds& a, const Bounds& b) { return {glm::min(a.low, b.low), glm::max(a.high, b.high)}; }

bool apart(const Bounds& a, const Bounds& b, double gap) {
  for (int axis = 0; axis < 3; ++axis)
    if (double(a.low[axis]) - b.high[axis] > gap || double(b.low[axis]) - a.high[axis] > gap) return true;
  return false;
}

/// A tree of bounding boxes over the triangles, halved along the widest axis. Node n has the children 2n+1 and 2n+2.
class Tree {
 public:
  explicit Tree(std::span<const glm::vec3> vertices) : vertices_(vertices), order_(vertices.size() / 3) {
    std::iota(order_.begin(), order_.end(), 0u);
    for (std::size_t t = 0; t < order_.size(); ++t) {
      const glm::vec3* v = &vertices[3 * t];
      boxes_.push_back({glm::min(glm::min(v[0], v[1]), v[2]), glm::max(glm::max(v[0], v[1]), v[2])});
    }
    if (!order_.empty()) build(0, 0, order_.size());
  }

  /// Merges all pairs of triangles whose distance is at most the smaller one of their `reaches`.
  void merge_near(std::span<const double> reaches, MergedSets& sets) const {
    if (order_.empty()) return;
    for (std::uint32_t t = 0; t < order_.size(); ++t) merge_with(0, 0, order_.size(), t, reaches, sets);
  }

 private:
  static constexpr std::size_t kLeaf = 4;

  void build(std::size_t node, std::size_t first, std::size_t last) {
    Bounds bounds = boxes_[order_[first]];
    for (std::size_t i = first; i < last; ++i) bounds = joined(bounds, boxes_[order_[i]]);
    if (nodes_.size() <= node) nodes_.resize(node + 1);
    nodes_[node] = {bounds,
                    *std::min_element(order_.begin() + std::ptrdiff_t(first), order_.begin() + std::ptrdiff_t(last))};
    if (last - first <= kLeaf) return;
    const glm::vec3 size = bounds.high - bounds.low;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = (first + last) / 2;
    std::nth_element(order_.begin() + std::ptrdiff_t(first), order_.begin() + std::ptrdiff_t(middle),
                     order_.begin() + std::ptrdiff_t(last), [&](std::uint32_t a, std::uint32_t b) {
                       return boxes_[a].low[axis] + boxes_[a].high[axis] < boxes_[b].low[axis] + boxes_[b].high[axis];
                     });
    build(2 * node + 1, first, middle);
    build(2 * node + 2, middle, last);
  }

  Corners3 corners(std::uint32_t t) const {
    return {glm::dvec3(vertices_[3 * t]), glm::dvec3(vertices_[3 * t + 1]), glm::dvec3(vertices_[3 * t + 2])};
  }

  /// Visits the triangles before `t`, so that each pair is compared once.
  void merge_with(std::size_t node, std::size_t first, std::size_t last, std::uint32_t t,
                  std::span<const double> reaches, MergedSets& sets) const {
    if (nodes_[node].lowest >= t || apart(nodes_[node].bounds, boxes_[t], reaches[t])) return;
    if (last - first > kLeaf) {
      const std::size_t middle = (first + last) / 2;
      merge_with(2 * node + 1, first, middle, t, reaches, sets);
      merge_with(2 * node + 2, middle, last, t, reaches, sets);
      return;
    }
    for (std::size_t i = first; i < last; ++i) {
      const std::uint32_t other = order_[i];
      if (other >= t || sets.find(other) == sets.find(t)) continue;
      const double reach = std::min(reaches[other], reaches[t]);
      if (!apart(boxes_[other], boxes_[t], reach) && distance(corners(other), corners(t)) <= reach)
        sets.merge(other, t);
    }
  }

  struct Node {
    Bounds bounds;
    std::uint32_t lowest;  // triangle
  };
  std::span<const glm::vec3> vertices_;
  std::vector<std::uint32_t> order_;
  std::vector<Bounds> boxes_;  // per triangle
  std::vector<Node> nodes_;
};

double area(const glm::vec3* v) {
  const glm::dvec3 a(v[0]), b(v[1]), c(v[2]);
  return 0.5 * glm::length(glm::cross(b - a, c - a));
}

double longest_edge(const glm::vec3* v) {
  return std::max({glm::distance(glm::dvec3(v[0]), glm::dvec3(v[1])), glm::distance(glm::dvec3(v[1]), glm::dvec3(v[2])),
                   glm::distance(glm::dvec3(v[2]), glm::dvec3(v[0]))});
}

}  // namespace

std::vector<Piece> pieces(std::span<const glm::vec3> vertices, double gap) {
  const std::size_t count = vertices.size() / 3;
  std::vector<double> reaches;
  for (std::size_t t = 0; t < count; ++t) reaches.push_back(gap * longest_edge(&vertices[3 * t]));
  MergedSets sets(count);
  Tree(vertices).merge_near(reaches, sets);
  std::vector<Piece> found;
  std::vector<std::size_t> piece_of(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    // The root of a set is its lowest triangle, so it comes first.
    const std::uint32_t root = sets.find(t);
    if (root == t) {
      piece_of[t] = found.size();
      found.emplace_back();
    }
    Piece& piece = found[piece_of[root]];
    piece.triangles.push_back(t);
    piece.area += area(&vertices[3 * t]);
  }
  std::stable_sort(found.begin(), found.end(), [](const Piece& a, const Piece& b) {
    return std::pair(a.triangles.size(), a.area) > std::pair(b.triangles.size(), b.area);
  });
  return found;
}

}  // namespace trisoup::soup
