// Makes a trained soup smaller, round by round, until it just meets a goal (docs/method.md, "Simplifying").
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "soup/soup.h"
#include "train/config/settings.h"
#include "train/topology/importance.h"
#include "train/topology/refine.h"

namespace trisoup::train {

class Trainer;

/// Shares of a soup's bytes and triangles to keep, 0..1.
struct Shares {
  double bytes = 1, triangles = 1;
  bool operator==(const Shares&) const = default;
};
/// Removes what is least important for its bytes until `shares` are met. Removes at most one thing per triangle: the
/// triangle or the finest level of its texture. Keeps at least one triangle, and all triangles of the backdrop. If
/// shares.triangles is below 1, removes whole triangles only, until that share is met. backdrop: [T]
Pruned least_important_removed(const Importance& importance, std::span<const soup::TextureEntry> table,
                               const std::vector<bool>& backdrop, const Shares& shares);

/// Whether `pruned` removes a triangle or a level.
bool takes_away(const Pruned& pruned, std::span<const soup::TextureEntry> table);

/// Removes what gains less than `knee` dB for twice the samples, by the squared errors of `importance` and without
/// further training. Otherwise as above. Keeps triangles that are invisible in the views of `importance`, and triangles
/// that become visible in place of removed ones: each of several layers of the same colour looks dispensable, but
/// together they are not.
Pruned pruned_to_knee(const Importance& importance, std::span<const soup::TextureEntry> table,
                      const std::vector<bool>& backdrop, double knee);

/// A round of simplifying: the size of its model and its quality on the validation views, as it would be saved.
struct Round {
  std::uint64_t step = 0;
  std::uint64_t bytes = 0;
  std::uint32_t triangles = 0;
  double psnr = 0, ssim = 0;  // means over the validation views
  std::size_t from = 0;       // the round whose soup this one started from; 0 for the first
  bool smaller = false;       // whether something was removed from that soup
};

/// The start of the next round: the soup after round `from`, reduced to `shares`. Shares of 1 train that soup further.
struct NextRound {
  std::size_t from = 0;
  Shares shares;
  bool operator==(const NextRound&) const = default;
};

/// Whether a round's model meets all goals of the settings.
bool meets(const Round& round, const Settings& settings);
/// Whether `settings` have any goal.
bool has_goal(const Settings& settings);
/// The next round, or nothing if the search is over. It continues the last round or, if that removed too much, the best
/// one. `rounds` must not be empty.
std::optional<NextRound> next_round(std::span<const Round> rounds, const Settings& settings);
/// Index of the round whose model is the result. Among rounds that meet all goals: the one with the fewest bytes or, if
/// there are only goals of size, with the highest PSNR. If none does, the one that comes closest: in size first, then
/// in quality. `rounds` must not be empty.
std::size_t best_round(std::span<const Round> rounds, const Settings& settings);
/// One line: whether the goal is met, size and quality and, if the goal is missed, what to change.
std::string outcome(std::span<const Round> rounds, const Settings& settings);

nlohmann::json to_json(std::span<const Round> rounds);
std::vector<Round> rounds_from_json(const nlohmann::json& json);  // throws Error

}  // namespace trisoup::train
