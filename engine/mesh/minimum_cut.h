// Minimum cut of a network whose nodes have at most four neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace trisoup::soup {

/// Nodes between a source and a sink. Tetrahedra are nodes, their faces are arcs.
struct CutNetwork {
  static constexpr std::uint32_t kNoNode = 0xffffffffu;

  /// Per node, its neighbours, or kNoNode.
  std::vector<std::array<std::uint32_t, 4>> across;
  /// Per node and neighbour, this node's place among the neighbour's four.
  std::vector<std::array<std::uint8_t, 4>> back;
  /// Per node and neighbour, the cost of having the node on the source's side and the neighbour on the sink's. >= 0.
  std::vector<std::array<std::int64_t, 4>> capacity;
  /// Per node, the cost of having it on the sink's side less that of having it on the source's.
  std::vector<std::int64_t> source;
};

/// Returns the nodes on the source's side of the cheapest cut; of several, those of the smallest side. Sums must stay
/// below 2^63. Incremental breadth-first search (Goldberg, Hed, Kaplan, Tarjan, Werneck, "Maximum flows by incremental
/// breadth-first search", ESA 2011): its paths are shortest ones, so that large empty regions cost little.
std::vector<bool> minimum_cut(CutNetwork network);

}  // namespace trisoup::soup
