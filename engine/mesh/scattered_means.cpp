#include "mesh/scattered_means.h"

#include <algorithm>
#include <cmath>

namespace trisoup::soup {
namespace {

constexpr int kMostLevels = 20;
/// A cell stands for its points where it is smaller than this share of its distance (Barnes, Hut 1986).
constexpr float kOpening = 0.6f;

std::uint64_t spread_bits(std::uint32_t value) {
  std::uint64_t spread = 0;
  for (int bit = 0; bit <= kMostLevels; ++bit) spread |= (std::uint64_t(value) >> bit & 1u) << (3 * bit);
  return spread;
}

std::uint64_t morton(const glm::uvec3& cell) {
  return spread_bits(cell.x) | spread_bits(cell.y) << 1 | spread_bits(cell.z) << 2;
}

}  // namespace

ScatteredMeans::ScatteredMeans(std::span<const Point> points, float cell) {
  glm::vec3 low = points[0].position, high = low;
  for (const Point& p : points) low = glm::min(low, p.position), high = glm::max(high, p.position);
  const glm::vec3 sides = high - low;
  const float side = std::max({sides.x, sides.y, sides.z});
  cell_ = std::max(cell, side / float((1u << kMostLevels) - 1));
  std::size_t above = 0;  // levels above the smallest cells
  while (side > cell_ * std::exp2(float(above))) ++above;

  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(points.size());
  for (const Point& p : points)
    order.emplace_back(morton(glm::uvec3((p.position - low) / cell_)), static_cast<std::uint32_t>(order.size()));
  std::sort(order.begin(), order.end());
  std::vector<Node> leaves;
  for (const auto& [key, index] : order) {
    const Point& p = points[index];
    Node node{.key = key, .weight = p.weight, .moment = p.weight * p.position};
    for (std::size_t c = 0; c < kChannels; ++c) node.sums[c] = p.weight * p.values[c];
    add(leaves, node);
  }
  levels_.push_back(std::move(leaves));
  while (levels_.size() <= above) {
    std::vector<Node> parents;
    const std::vector<Node>& children = levels_.back();
    for (std::uint32_t i = 0; i < children.size(); ++i) {
      Node node = children[i];
      node.key >>= 3;
      node.first = i, node.last = i + 1;
      add(parents, node);
    }
    levels_.push_back(std::move(parents));
  }
}

void ScatteredMeans::add(std::vector<Node>& nodes, const Node& node) {
  if (nodes.empty() || nodes.back().key != node.key) return nodes.push_back(node);
  Node& to = nodes.back();
  to.last = node.last;
  to.weight += node.weight;
  to.moment += node.moment;
  for (std::size_t c = 0; c < kChannels; ++c) to.sums[c] += node.sums[c];
}

void ScatteredMeans::sum(std::size_t level, const Node& node, const glm::vec3& position, Sums& sums) const {
  const glm::vec3 apart = node.moment / node.weight - position;
  const float squared = glm::dot(apart, apart), side = cell_ * std::exp2(static_cast<float>(level));
  if (level > 0 && side * side > kOpening * kOpening * squared) {
    for (std::uint32_t i = node.first; i < node.last; ++i) sum(level - 1, levels_[level - 1][i], position, sums);
    return;
  }
  const double distance = std::max(squared, 0.25f * cell_ * cell_), share = 1 / (distance * distance);
  sums.weight += share * node.weight;
  for (std::size_t c = 0; c < kChannels; ++c) sums.values[c] += share * node.sums[c];
}

ScatteredMeans::Values ScatteredMeans::at(const glm::vec3& position) const {
  Sums sums;
  for (const Node& root : levels_.back()) sum(levels_.size() - 1, root, position, sums);
  Values means;
  for (std::size_t c = 0; c < kChannels; ++c) means[c] = static_cast<float>(sums.values[c] / sums.weight);
  return means;
}

}  // namespace trisoup::soup
