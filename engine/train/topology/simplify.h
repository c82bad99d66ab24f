// A trained soup made smaller, round by round, until it just meets a goal (docs/method.md, "Simplifying").
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

/// What there is of a soup to give up: share of its bytes and of its triangles that is to stay, 0..1.
struct Shares {
  double bytes = 1, triangles = 1;
  bool operator==(const Shares&) const = default;
};
/// The soup without what is worth least for the bytes that it takes: of each triangle at most the whole or its finest
/// level goes, the backdrop's triangles stay. At least one triangle is kept. backdrop: [T].
Pruned least_important_removed(const Importance& importance, std::span<const soup::TextureEntry> table,
                               const std::vector<bool>& backdrop, const Shares& shares);

/// Whether a triangle, or a level of one, goes.
bool takes_away(const Pruned& pruned, std::span<const soup::TextureEntry> table);

/// The soup at its knee: without what brings less than `knee` dB for twice the samples, by the squared errors of
/// `importance` and before anything is trained on. Otherwise as above; what no view of `importance` shows stays, and so
/// does what stands in for a triangle that goes: of several layers of one colour each looks as if it could go, but not
/// all of them can.
Pruned pruned_to_knee(const Importance& importance, std::span<const soup::TextureEntry> table,
                      const std::vector<bool>& backdrop, double knee);

/// A model as it would be saved, on the validation views.
struct Round {
  std::uint64_t step = 0;
  std::uint64_t bytes = 0;
  std::uint32_t triangles = 0;
  double psnr = 0, ssim = 0;  // means over the validation views
  std::size_t from = 0;       // the round whose soup this one began with; the first one is its own
  bool smaller = false;       // and whether something was taken from it
};

/// What the round to come begins with: the soup that was there after round `from`, of which so much is to stay. The
/// shares are 1 where the same soup is to be trained on.
struct NextRound {
  std::size_t from = 0;
  Shares shares;
  bool operator==(const NextRound&) const = default;
};

/// Whether a round's model is within the goal of the settings.
bool meets(const Round& round, const Settings& settings);
/// Whether `settings` have a goal.
bool has_goal(const Settings& settings);
/// What to do after the rounds so far, or nothing where there is no next one. Either the last round goes on, or, where
/// too much was taken, the best one does.
std::optional<NextRound> next_round(std::span<const Round> rounds, const Settings& settings);
/// The round whose model is the result: of those that meet the goal the one of fewest bytes (of triangles, where these
/// are the goal); where none does the one that comes closest. Throws nothing; rounds must not be empty.
std::size_t best_round(std::span<const Round> rounds, const Settings& settings);
/// In one line how far it got, and what is in the way where the goal is not met.
std::string outcome(std::span<const Round> rounds, const Settings& settings);

nlohmann::json to_json(std::span<const Round> rounds);
std::vector<Round> rounds_from_json(const nlohmann::json& json);  // throws Error

}  // namespace trisoup::train
