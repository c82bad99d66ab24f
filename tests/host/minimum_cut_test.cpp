#include <algorithm>
#include <bit>
#include <random>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/push_relabel_max_flow.hpp>
#include <catch2/catch.hpp>

#include "mesh/minimum_cut.h"

namespace {

using trisoup::soup::CutNetwork;
using trisoup::soup::minimum_cut;

void connect(CutNetwork& network, std::uint32_t a, std::uint32_t b, std::int64_t there, std::int64_t back) {
  const auto free_place = [&](std::uint32_t v) {
    return std::find(network.across[v].begin(), network.across[v].end(), CutNetwork::kNoNode) -
           network.across[v].begin();
  };
  const auto i = static_cast<std::size_t>(free_place(a)), j = static_cast<std::size_t>(free_place(b));
  if (i >= 4 || j >= 4 || a == b) return;
  network.across[a][i] = b, network.across[b][j] = a;
  network.back[a][i] = static_cast<std::uint8_t>(j), network.back[b][j] = static_cast<std::uint8_t>(i);
  network.capacity[a][i] = there, network.capacity[b][j] = back;
}

CutNetwork network_of(std::uint32_t nodes) {
  constexpr std::uint32_t kNone = CutNetwork::kNoNode;
  CutNetwork network;
  network.across.assign(nodes, {kNone, kNone, kNone, kNone});
  network.back.resize(nodes);
  network.capacity.resize(nodes);
  network.source.resize(nodes);
  return network;
}

/// few_sources: most nodes are tied to neither side, so that ways are long.
CutNetwork random_network(std::uint32_t nodes, bool few_sources, std::mt19937& random) {
  CutNetwork network = network_of(nodes);
  const auto up_to = [&](std::int64_t n) { return std::uniform_int_distribution<std::int64_t>(0, n)(random); };
  for (std::uint32_t i = 0; i < 3 * nodes; ++i) {
    const auto a = static_cast<std::uint32_t>(up_to(nodes - 1));
    const std::uint32_t b = few_sources ? std::min(a + 1 + static_cast<std::uint32_t>(up_to(4)), nodes - 1)
                                        : static_cast<std::uint32_t>(up_to(nodes - 1));
    connect(network, a, b, up_to(9), up_to(9));
  }
  for (std::uint32_t v = 0; v < nodes; ++v)
    network.source[v] = few_sources && v > nodes / 8 && v < nodes - nodes / 8 ? 0 : up_to(20) - 10;
  return network;
}

std::int64_t cost(const CutNetwork& network, const std::vector<bool>& source_side) {
  std::int64_t sum = 0;
  for (std::size_t v = 0; v < network.source.size(); ++v) {
    if (source_side[v] != (network.source[v] > 0)) sum += std::abs(network.source[v]);
    for (std::size_t k = 0; k < 4; ++k)
      if (network.across[v][k] != CutNetwork::kNoNode && source_side[v] && !source_side[network.across[v][k]])
        sum += network.capacity[v][k];
  }
  return sum;
}

std::int64_t flow_of_boost(const CutNetwork& network) {
  using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;
  using Graph = boost::adjacency_list<
      boost::vecS, boost::vecS, boost::directedS, boost::no_property,
      boost::property<boost::edge_capacity_t, std::int64_t,
                      boost::property<boost::edge_residual_capacity_t, std::int64_t,
                                      boost::property<boost::edge_reverse_t, Traits::edge_descriptor>>>>;
  const std::size_t n = network.source.size();
  Graph graph(n + 2);
  const auto arc = [&](std::size_t a, std::size_t b, std::int64_t capacity) {
    const auto there = boost::add_edge(a, b, graph).first, back = boost::add_edge(b, a, graph).first;
    boost::put(boost::edge_capacity, graph, there, capacity), boost::put(boost::edge_capacity, graph, back, 0);
    boost::put(boost::edge_reverse, graph, there, back), boost::put(boost::edge_reverse, graph, back, there);
  };
  for (std::size_t v = 0; v < n; ++v) {
    arc(n, v, std::max<std::int64_t>(network.source[v], 0)),
        arc(v, n + 1, std::max<std::int64_t>(-network.source[v], 0));
    for (std::size_t k = 0; k < 4; ++k)
      if (network.across[v][k] != CutNetwork::kNoNode) arc(v, network.across[v][k], network.capacity[v][k]);
  }
  return boost::push_relabel_max_flow(graph, n, n + 1);
}

}  // namespace

TEST_CASE("no cut of a small network is cheaper, and none as cheap is smaller", "[surface]") {
  std::mt19937 random(1);
  for (int trial = 0; trial < 500; ++trial) {
    const auto nodes = static_cast<std::uint32_t>(2 + trial % 9);
    const CutNetwork network = random_network(nodes, trial % 2 == 1, random);
    const std::vector<bool> side = minimum_cut(network);
    const std::int64_t found = cost(network, side);
    const auto size = std::count(side.begin(), side.end(), true);
    for (std::uint32_t mask = 0; mask < (1u << nodes); ++mask) {
      std::vector<bool> other(nodes);
      for (std::uint32_t v = 0; v < nodes; ++v) other[v] = ((mask >> v) & 1) != 0;
      const std::int64_t price = cost(network, other);
      if (price < found || (price == found && std::popcount(mask) < size)) FAIL_CHECK(trial << ": " << mask);
    }
  }
}

TEST_CASE("cuts of large networks cost the largest flow", "[surface]") {
  std::mt19937 random(2);
  for (const bool few_sources : {false, true})
    for (const std::uint32_t nodes : {100u, 3'000u, 20'000u}) {
      const CutNetwork network = random_network(nodes, few_sources, random);
      CHECK(cost(network, minimum_cut(network)) == flow_of_boost(network));
    }
}

TEST_CASE("a cut goes through the narrowest place of a long tube", "[surface]") {
#ifdef TRISOUP_SANITIZED
  constexpr std::uint32_t kNodes = 10'000;
#else
  constexpr std::uint32_t kNodes = 100'000;
#endif
  constexpr std::uint32_t kNarrow = kNodes / 10 * 7;
  CutNetwork network = network_of(kNodes);
  for (std::uint32_t v = 0; v + 1 < kNodes; ++v) connect(network, v, v + 1, v == kNarrow ? 5 : 6, 0);
  network.source.front() = 1'000'000'000'000, network.source.back() = -1'000'000'000'000;
  const std::vector<bool> side = minimum_cut(network);
  CHECK(std::count(side.begin(), side.end(), true) == kNarrow + 1);
  CHECK(side[kNarrow]);
}

TEST_CASE("networks without a source, a sink or nodes are cut", "[surface]") {
  CHECK(minimum_cut(network_of(0)).empty());
  CutNetwork network = network_of(3);
  connect(network, 0, 1, 2, 0);
  CHECK(minimum_cut(network) == std::vector<bool>{false, false, false});
  network.source[0] = 1;
  CHECK(minimum_cut(network) == std::vector<bool>{true, true, false});
}
