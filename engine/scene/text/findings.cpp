#include "scene/text/findings.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/printable.h"

namespace trisoup::scene {
namespace {

// Limits memory and time for a file with millions of unusable records.
constexpr std::size_t kMaxNames = 3, kMaxProblems = 12;

}  // namespace

Findings::Group& Findings::group(const std::string& source, const std::string& kind, const std::string& problem) {
  std::size_t alike = 0;
  for (Group& group : groups_) {
    if (group.source != source || group.kind != kind) continue;
    if (group.problem == problem) return group;
    ++alike;
  }
  const std::string others = "other problems";
  if (alike >= kMaxProblems && problem != others) return group(source, kind, others);
  return groups_.emplace_back(Group{source, kind, problem, 0, {}});
}

void Findings::leave_out(const std::string& source, const std::string& kind, const std::string& problem,
                         const std::string& name) {
  Group& same = group(source, kind, problem);
  if (same.count++ < kMaxNames) same.names.push_back(name);
}

void Findings::warn(const std::string& line) {
  const bool known = std::any_of(groups_.begin(), groups_.end(),
                                 [&](const Group& group) { return group.kind.empty() && group.problem == line; });
  if (!known) groups_.push_back({{}, {}, line, 0, {}});
}

void Findings::add(const Findings& other) {
  for (const Group& group : other.groups_) {
    if (group.kind.empty()) {
      warn(group.problem);
      continue;
    }
    Group& same = this->group(group.source, group.kind, group.problem);
    same.count += group.count;
    for (const std::string& name : group.names)
      if (same.names.size() < kMaxNames) same.names.push_back(name);
  }
}

std::size_t Findings::left_out(std::string_view kind) const {
  std::size_t count = 0;
  for (const Group& group : groups_)
    if (group.kind == kind) count += group.count;
  return count;
}

std::vector<std::string> Findings::lines() const {
  std::vector<std::string> lines;
  for (const Group& group : groups_) {
    if (group.kind.empty()) {
      lines.push_back(group.problem);
      continue;
    }
    const std::size_t others = group.count - group.names.size();
    std::string names;
    for (std::size_t i = 0; i < group.names.size(); ++i) names += (i == 0 ? "" : ", ") + printable(group.names[i]);
    if (others > 0) names += fmt::format(" and {} more", others);
    const std::string kind =
        group.count == 1 && group.kind.ends_with('s') ? group.kind.substr(0, group.kind.size() - 1) : group.kind;
    lines.push_back(fmt::format("{}: left out {} {}: {}: {}", group.source, group.count, kind, group.problem, names));
  }
  return lines;
}

}  // namespace trisoup::scene
