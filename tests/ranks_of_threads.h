// Ranks that are threads of one process, whose messages arrive late and in any order: what rests on luck fails here
// sooner.
#pragma once

#include <functional>

#include "ranks/ranks.h"

namespace trisoup::test {

/// Runs `body` as each of `size` ranks, each in a thread of its own, to the end. A rank whose body throws leaves, as a
/// program's would. What each has thrown, in order of rank; empty where nothing.
std::vector<std::string> run_as_ranks(int size, const std::function<void(ranks::Ranks&)>& body, std::uint64_t seed = 1);

}  // namespace trisoup::test
