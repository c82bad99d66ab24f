#include "scene/findings.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/printable.h"

namespace trisoup::scene {
namespace {

constexpr std::size_t kMaxNames = 3;

}  // namespace

void Findings::leave_out(const std::string& source, const std::string& kind, const std::string& problem,
                         const std::string& name) {
  const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const Group& group) {
    return group.source == source && group.kind == kind && group.problem == problem;
  });
  Group& group = same != groups_.end() ? *same : groups_.emplace_back(Group{source, kind, problem, {}});
  group.names.push_back(name);
}

void Findings::warn(const std::string& line) {
  const bool known = std::any_of(groups_.begin(), groups_.end(), [&](const Group& group) {
    return group.kind.empty() && group.problem == line;
  });
  if (!known) groups_.push_back({{}, {}, line, {}});
}

void Findings::add(const Findings& other) {
  for (const Group& group : other.groups_) {
    if (group.kind.empty()) warn(group.problem);
    for (const std::string& name : group.names) leave_out(group.source, group.kind, group.problem, name);
  }
}

std::size_t Findings::left_out(std::string_view kind) const {
  std::size_t count = 0;
  for (const Group& group : groups_)
    if (group.kind == kind) count += group.names.size();
  return count;
}

std::vector<std::string> Findings::lines() const {
  std::vector<std::string> lines;
  for (const Group& group : groups_) {
    if (group.kind.empty()) {
      lines.push_back(group.problem);
      continue;
    }
    const std::size_t shown = std::min(group.names.size(), kMaxNames), others = group.names.size() - shown;
    std::string names;
    for (std::size_t i = 0; i < shown; ++i) names += (i == 0 ? "" : ", ") + printable(group.names[i]);
    if (others > 0) names += fmt::format(" and {} more", others);
    const std::string kind =
        group.names.size() == 1 && group.kind.ends_with('s') ? group.kind.substr(0, group.kind.size() - 1) : group.kind;
    lines.push_back(
        fmt::format("{}: left out {} {}: {}: {}", group.source, group.names.size(), kind, group.problem, names));
  }
  return lines;
}

}  // namespace trisoup::scene
