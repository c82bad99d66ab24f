#include "together.h"

#include <stdlib.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "scene/datasets/unposed.h"

namespace trisoup {
namespace {

template <typename T>
void append(ranks::Bytes& to, const std::vector<T>& values) {
  const auto bytes = ranks::bytes_of(values);
  to.insert(to.end(), bytes.begin(), bytes.end());
}

std::string text_of(const ranks::Bytes& bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace

CommandLine of_rank(CommandLine options, const ranks::Ranks& ranks) {
  if (ranks.size() == 1) return options;
  if (options.view)
    throw Error(
        "--view: {} processes were started, and the window looks on at a single one; leave it out, or start one "
        "process",
        ranks.size());
  if (options.serving.serve)
    throw Error(
        "--serve: {} processes were started, and the page looks on at a single one; leave it out, or start one "
        "process",
        ranks.size());
  if (!options.model.empty())
    throw Error("{}: {} processes were started, and one alone makes a model smaller; start one process", options.model,
                ranks.size());
  if (scene::find_unposed(options.dataset))
    throw Error(
        "{}: has no poses, and one process alone looks for them; run the same command as one process until it trains, "
        "then start several "
        "with OUT/colmap as DATASET and another -o",
        options.dataset);
  if (ranks.is_first()) return options;
  options.quiet = options.warnings_elsewhere = true;
  options.timings = false;
  return options;
}

RankOutput::RankOutput(const std::filesystem::path& output, const ranks::Ranks& ranks) : path_(output) {
  if (ranks.is_first()) return;
  std::string name = (std::filesystem::temp_directory_path() / "soup-train-rank-XXXXXX").string();
  if (!::mkdtemp(name.data()))
    throw Error("{}: cannot be made ({}); set TMPDIR to a folder that can be written", name, std::strerror(errno));
  path_ = name;
  scratch_ = true;
}

RankOutput::~RankOutput() {
  std::error_code ignored;
  if (scratch_) std::filesystem::remove_all(path_, ignored);
}

bool broadcast(ranks::Ranks& ranks, bool first) {
  return ranks::values_of<std::uint8_t>(ranks.broadcast(0, ranks::bytes_of(std::vector<std::uint8_t>{first})))[0] != 0;
}

std::uint32_t minimum(ranks::Ranks& ranks, std::uint32_t mine) {
  for (const ranks::Bytes& message : ranks.all_gather(ranks::bytes_of(std::vector{mine})))
    mine = std::min(mine, ranks::values_of<std::uint32_t>(message)[0]);
  return mine;
}

train::Start same_start(ranks::Ranks& ranks, const std::function<train::Start()>& compute) {
  if (ranks.size() == 1) return compute();
  ranks::Bytes bytes;
  if (ranks.is_first()) {
    const train::Start start = compute();
    append(bytes, std::vector<std::uint64_t>{start.vertices.size(), start.colours.size(), start.opaque});
    append(bytes, start.vertices);
    append(bytes, start.colours);
  }
  bytes = ranks.broadcast(0, bytes);
  constexpr std::size_t kHead = 3 * sizeof(std::uint64_t);
  const auto sizes = ranks::values_of<std::uint64_t>(ranks::ByteView(bytes).first(kHead));
  const auto points = ranks::values_of<glm::vec3>(ranks::ByteView(bytes).subspan(kHead));
  const auto colours = points.begin() + static_cast<std::ptrdiff_t>(sizes[0]);
  train::Start start;
  start.vertices.assign(points.begin(), colours);
  start.colours.assign(colours, points.end());
  start.opaque = sizes[2];
  return start;
}

void check_same(ranks::Ranks& ranks, const std::string& what, const std::string& mine) {
  const std::vector<ranks::Bytes> all = ranks.all_gather(std::as_bytes(std::span(mine)));
  for (std::size_t r = 1; r < all.size(); ++r)
    if (all[r] != all[0])
      throw Error(
          "rank {} of {}: has another {} than rank 0, {} and not {}; start all with the same build, dataset and "
          "options",
          r, ranks.size(), what, text_of(all[r]), text_of(all[0]));
}

void check_same(ranks::Ranks& ranks, const train::Settings& mine) {
  const std::string text = to_json(mine).dump();
  const std::vector<ranks::Bytes> all = ranks.all_gather(std::as_bytes(std::span(text)));
  const auto settings_of = [&](std::size_t r) {
    return train::settings_from_json(nlohmann::json::parse(text_of(all[r])));
  };
  for (std::size_t r = 1; r < all.size(); ++r)
    if (all[r] != all[0])
      throw Error("rank {} of {}: has other settings than rank 0: {}; start all with the same options", r, ranks.size(),
                  train::differences(settings_of(0), settings_of(r)));
}

}  // namespace trisoup
