// What a training of several ranks (ranks/ranks.h) does otherwise than one by itself: the first rank speaks and writes,
// all are told what it has found, and what differs between them is an error before the first step.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "command_line.h"
#include "ranks/ranks.h"
#include "train/start/initial_triangles.h"

namespace trisoup {

/// The command line as this rank follows it. Ranks but the first are quiet and measure nothing. Throws Error on what
/// several ranks cannot do.
CommandLine of_rank(CommandLine options, const ranks::Ranks& ranks);

/// Where a rank writes: `output` for the first, for the others a folder of their own that goes with this object.
class RankOutput {
 public:
  RankOutput(const std::filesystem::path& output, const ranks::Ranks& ranks);
  ~RankOutput();
  RankOutput(const RankOutput&) = delete;
  RankOutput& operator=(const RankOutput&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool scratch_ = false;
};

/// What the first rank says, on all.
bool broadcast(ranks::Ranks& ranks, bool first);
/// The least of what they say, on all.
std::uint32_t minimum(ranks::Ranks& ranks, std::uint32_t mine);
/// What the first rank starts from, on all: others do not compute it.
train::Start same_start(ranks::Ranks& ranks, const std::function<train::Start()>& compute);
/// Throws Error on every rank where one says something else than the first; `what` names it.
void check_same(ranks::Ranks& ranks, const std::string& what, const std::string& mine);
void check_same(ranks::Ranks& ranks, const train::Settings& mine);

}  // namespace trisoup
