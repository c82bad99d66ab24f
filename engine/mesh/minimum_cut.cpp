#include "mesh/minimum_cut.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "base/cancellation.h"

namespace trisoup::soup {
namespace {

/// Two breadth-first trees: arcs with capacity left lead from the source to all nodes of one, and from all nodes of the
/// other to the sink. Where they touch, flow is sent. Nodes that lose their way are hung up elsewhere at once.
class Trees {
 public:
  explicit Trees(CutNetwork network) : network_(std::move(network)) {
    const auto n = static_cast<std::uint32_t>(network_.across.size());
    depth_.resize(n);
    parent_.resize(n, kNone);
    for (std::uint32_t v = 0; v < n; ++v)
      if (network_.source[v] != 0) {
        const Side side = network_.source[v] > 0 ? kSource : kSink;
        depth_[v] = side;
        parent_[v] = kRoot;
        frontier(side).push_back(v);
      }
  }

  std::vector<bool> source_side() {
    // The sink's tree grows only if it would be the shorter list: one deep tree is cheaper than two.
    while (!frontier(kSource).empty()) {
      check_cancellation();
      grow(frontier(kSink).empty() || frontier(kSource).size() <= frontier(kSink).size() ? kSource : kSink);
    }
    std::vector<bool> result;
    for (const std::int32_t depth : depth_) result.push_back(depth > 0);
    return result;
  }

 private:
  /// Also the sign of the depths in its tree.
  enum Side : std::int32_t { kSource = 1, kSink = -1 };
  static constexpr std::uint8_t kRoot = 4, kNone = 5;  // in parent_, beside places among neighbours

  std::vector<std::uint32_t>& frontier(Side side) { return frontiers_[side == kSource ? 0 : 1]; }
  int& height(Side side) { return heights_[side == kSource ? 0 : 1]; }

  /// What is left of the arc between v and its neighbour k, towards v if `side` is the source's, else away from it.
  std::int64_t& left_from_tree(Side side, std::uint32_t v, std::size_t k) {
    return side == kSource ? network_.capacity[network_.across[v][k]][network_.back[v][k]] : network_.capacity[v][k];
  }
  std::int64_t& left_to_tree(Side side, std::uint32_t v, std::size_t k) {
    return left_from_tree(side == kSource ? kSink : kSource, v, k);
  }

  /// Adds all nodes next to the last level of a tree.
  void grow(Side side) {
    const std::vector<std::uint32_t> level = std::exchange(frontier(side), {});
    const int depth = height(side)++;
    for (const std::uint32_t v : level)
      for (std::size_t k = 0; k < 4 && depth_[v] == side * depth;) {
        const std::uint32_t to = network_.across[v][k];
        if (to == CutNetwork::kNoNode || depth_[to] * side > 0 || left_to_tree(side, v, k) <= 0) {
          ++k;
        } else if (depth_[to] == 0) {
          depth_[to] = side * (depth + 1);
          parent_[to] = network_.back[v][k];
          frontier(side).push_back(to);
          ++k;
        } else if (side == kSource) {
          augment(v, k);  // and look again, since capacity may be left
        } else {
          augment(to, network_.back[v][k]);
        }
      }
  }

  /// Sends what fits from the source to the sink by way of v and its neighbour k.
  void augment(std::uint32_t v, std::size_t k) {
    const std::uint32_t to = network_.across[v][k];
    std::int64_t& middle = network_.capacity[v][k];
    const std::int64_t flow = std::min({middle, least_left(kSource, v), least_left(kSink, to)});
    middle -= flow;
    network_.capacity[to][network_.back[v][k]] += flow;
    send(kSource, v, flow);
    send(kSink, to, flow);
  }

  std::int64_t least_left(Side side, std::uint32_t v) {
    std::int64_t least = INT64_MAX;
    for (; parent_[v] != kRoot; v = network_.across[v][parent_[v]])
      least = std::min(least, left_from_tree(side, v, parent_[v]));
    return std::min(least, std::abs(network_.source[v]));
  }

  void send(Side side, std::uint32_t v, std::int64_t flow) {
    for (; parent_[v] != kRoot;) {
      const std::size_t k = parent_[v];
      std::int64_t& left = left_from_tree(side, v, k);
      left -= flow;
      left_to_tree(side, v, k) += flow;
      if (left == 0) orphan(v);
      v = network_.across[v][k];
    }
    network_.source[v] -= side * flow;
    if (network_.source[v] == 0) orphan(v);
    adopt(side);
  }

  void orphan(std::uint32_t v) {
    parent_[v] = kNone;
    const auto depth = static_cast<std::size_t>(std::abs(depth_[v]));
    if (orphans_.size() <= depth) orphans_.resize(depth + 1);
    orphans_[depth].push_back(v);
    first_orphans_ = std::min(first_orphans_, depth);
  }

  /// Gives every orphan the neighbour of least depth as its parent, or none. In the order of depths, since a node that
  /// sinks makes orphans of its children.
  void adopt(Side side) {
    for (std::size_t depth = first_orphans_; depth < orphans_.size(); ++depth) {
      for (std::size_t i = 0; i < orphans_[depth].size(); ++i) {  // it grows
        const std::uint32_t v = orphans_[depth][i];
        if (parent_[v] == kNone && depth_[v] == side * static_cast<int>(depth)) adopt(side, v);
      }
      orphans_[depth].clear();
    }
    first_orphans_ = SIZE_MAX;
  }

  void adopt(Side side, std::uint32_t v) {
    int above = height(side);  // depth of the parent
    std::uint8_t parent = kNone;
    if (side * network_.source[v] > 0) above = 0, parent = kRoot;
    for (std::uint8_t k = 0; k < 4 && parent != kRoot; ++k) {
      const std::uint32_t u = network_.across[v][k];
      if (u == CutNetwork::kNoNode || left_from_tree(side, v, k) <= 0) continue;
      const int depth = side * depth_[u];
      if (depth > 0 && depth < above) above = depth, parent = k;
    }
    const int depth = parent == kNone ? 0 : side * (above + 1);
    if (depth != depth_[v]) {
      for (const std::uint32_t u : network_.across[v])
        if (u != CutNetwork::kNoNode && parent_[u] < kRoot && network_.across[u][parent_[u]] == v) orphan(u);
      depth_[v] = depth;
      if (side * depth == height(side)) frontier(side).push_back(v);
    }
    parent_[v] = parent;
  }

  CutNetwork network_;                                   // with what is left of its capacities
  std::vector<std::int32_t> depth_;                      // from 1; of the sink's tree negative; 0: in no tree
  std::vector<std::uint8_t> parent_;                     // a place among the neighbours, kRoot or kNone
  std::array<std::vector<std::uint32_t>, 2> frontiers_;  // the last level of each tree; may hold others, and some twice
  std::array<int, 2> heights_{1, 1};
  std::vector<std::vector<std::uint32_t>> orphans_;  // by depth
  std::size_t first_orphans_ = SIZE_MAX;
};

}  // namespace

std::vector<bool> minimum_cut(CutNetwork network) { return Trees(std::move(network)).source_side(); }

}  // namespace trisoup::soup
