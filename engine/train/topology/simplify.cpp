#include "train/topology/simplify.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"

namespace trisoup::train {
namespace {

/// Size of a triangle without its texture, in samples: vertices and a row of the table.
constexpr double kTriangleInSamples = 6;
/// Assumed loss of a halving of the bytes, dB, until two rounds have measured it.
constexpr double kUsualSlope = 1.0;
/// A quality within this margin above its goal counts as just met.
constexpr double kCloseEnough = 0.04;  // dB
/// A round that misses the quality by less than this may reach it with more training.
constexpr double kNear = 0.3;  // dB
/// Expected gain of another round of training, as a share of the gain of the one before.
constexpr double kNextGain = 0.8;
/// If the margin above the quality is below kNearlyMet, another round must save more than this share of the bytes.
constexpr double kWorthARound = 0.04;
constexpr double kNearlyMet = 0.2;  // dB
/// If the quality is just met, one more round removes the share kProbe, to find out whether that meets it too. It is
/// skipped if a round with more than kSurelyMissed of the bytes has missed the quality.
constexpr double kProbe = 0.15, kSurelyMissed = 0.7;
/// Number of times that the search may return to its best round.
constexpr std::ptrdiff_t kMostReturns = 5;
/// An SSIM in dB, which makes it comparable with PSNR: -10 log10(1 - SSIM).
double decibels(double ssim) { return -10.0 * std::log10(std::max(1e-6, 1.0 - ssim)); }

/// The removal of a triangle or of its finest level.
struct Removal {
  double loss = 0, saves = 0;  // increase of the squared error; samples saved
  std::uint32_t triangle = 0;
  bool whole = false;
  double each() const { return loss / saves; }
};

/// The removal of the triangle's finest level.
Removal coarser(const Importance& importance, const soup::TextureEntry& row, std::uint32_t t) {
  return {std::max(0.0, importance.finest[t]),
          double(soup::samples_at(row.level_max) - soup::samples_at(row.level_max - 1)), t, false};
}

/// The removal with the smaller loss per saved sample: the triangle or its finest level. stays: the triangle must stay
/// (backdrop); then nothing if it has only one level.
std::optional<Removal> cheaper(const Importance& importance, const soup::TextureEntry& row, std::uint32_t t,
                               bool stays) {
  const Removal whole{std::max(0.0, importance.triangle[t]), soup::samples_at(row.level_max) + kTriangleInSamples, t,
                      true};
  if (row.level_max == 0) return stays ? std::nullopt : std::optional(whole);
  const Removal finest = coarser(importance, row, t);
  return stays || finest.each() < whole.each() ? finest : whole;
}

/// Margin of a round above its goals of quality, dB; negative if it misses one. Very large if there are none.
double above(const Round& r, const Settings& s) {
  double margin = 1e9;
  if (s.target_psnr > 0) margin = std::min(margin, r.psnr - s.target_psnr);
  if (s.target_ssim > 0 && std::isnan(r.ssim))
    throw Error("`target_ssim`: no view has the 11 x 11 pixels of an SSIM; use larger photographs or `target_psnr`");
  if (s.target_ssim > 0) margin = std::min(margin, decibels(r.ssim) - decibels(s.target_ssim));
  return margin;
}

/// Ratio of a round's size to its goal of size; met if at most 1.
double too_large(const Round& r, const Settings& s) {
  double max_ratio = 0;
  if (s.max_bytes > 0) max_ratio = std::max(max_ratio, double(r.bytes) / double(s.max_bytes));
  if (s.max_triangles > 0) max_ratio = std::max(max_ratio, double(r.triangles) / double(s.max_triangles));
  return max_ratio;
}

/// Loss per halving of the bytes from one round to a smaller one, dB.
double slope(const Round& larger, const Round& smaller, const Settings& s) {
  return (above(larger, s) - above(smaller, s)) / std::log2(double(larger.bytes) / double(smaller.bytes));
}

/// Loss per halving of the bytes in the latest reduction, dB.
double slope(std::span<const Round> rounds, const Settings& s) {
  for (std::size_t i = rounds.size() - 1; i > 0; --i) {
    const Round& before = rounds[rounds[i].from];
    if (double(before.bytes) > 1.035 * double(rounds[i].bytes))
      return std::clamp(slope(before, rounds[i], s), 0.3, 6.0);
  }
  return kUsualSlope;
}

/// Whether the soup of this round reached the quality with further training.
bool got_there(std::span<const Round> rounds, const Round& round, const Settings& s) {
  for (const Round& met : rounds)
    for (const Round* r = &met; above(met, s) >= 0 && !r->smaller && &rounds[r->from] != r; r = &rounds[r->from])
      if (&rounds[r->from] == &round) return true;
  return false;
}

/// The largest round below `max_bytes` bytes that missed the quality, also with further training; null if there is
/// none.
const Round* next_miss(std::span<const Round> rounds, std::uint64_t max_bytes, const Settings& s) {
  const Round* found = nullptr;
  for (const Round& r : rounds)
    if (above(r, s) < 0 && r.bytes < max_bytes && !got_there(rounds, r, s) && (!found || r.bytes >= found->bytes))
      found = &r;
  return found;
}

/// Number of times that the search has returned to an earlier round.
std::ptrdiff_t returns(std::span<const Round> rounds) {
  return std::count_if(rounds.begin() + 1, rounds.end(), [&](const Round& r) { return &rounds[r.from] + 1 != &r; });
}

/// The next round from a round above the quality: removes as much as is expected to end at the quality. Nothing if no
/// further round is worthwhile.
///
/// If a smaller round has missed the quality, interpolates towards it. Each halving costs more than the one before, so
/// linear interpolation ends above the quality. It goes at least half of the way, because the missed round had less
/// training. A round that reached the quality with further training no longer counts as missed.
std::optional<NextRound> towards_quality(std::span<const Round> rounds, std::size_t from, const Settings& s) {
  const Round& r = rounds[from];
  const double margin = above(r, s);
  if (margin < kCloseEnough) {
    const Round* known = next_miss(rounds, r.bytes, s);
    if (known && double(known->bytes) > kSurelyMissed * double(r.bytes)) return std::nullopt;
    return NextRound{from, {1 - kProbe, 1}};
  }
  const bool nearly = margin < kNearlyMet;
  const Round* miss = next_miss(rounds, std::uint64_t(double(r.bytes) * (nearly ? 1 : 1 - kWorthARound)), s);
  if (!miss)
    return NextRound{
        from,
        {std::clamp(std::exp2(-margin / std::max(slope(rounds, s), returns(rounds) > 0 ? kUsualSlope : 0)), 0.5, 0.97),
         1}};
  const double way = std::max(0.5, margin / (margin - above(*miss, s)));
  const double stays = std::pow(double(miss->bytes) / double(r.bytes), way);
  if (nearly && stays > 1 - kWorthARound) return std::nullopt;
  return NextRound{from, {std::max(0.5, stays), 1}};
}

/// Applies removals, at most one per triangle, in order of increasing loss per saved sample.
class Removals {
 public:
  explicit Removals(std::span<const soup::TextureEntry> table)
      : table_(table), goes_(table.size()), coarser_(table.size()), left_(table.size()) {}

  void add(const Removal& removal) { all_.push_back(removal); }
  /// Never removes both triangles of a pair in Importance::behind, because the loss of removing the first assumes that
  /// the second stays.
  void keep_stand_ins(const Importance& importance) { behind_ = importance.behind, stands_in_.resize(table_.size()); }
  /// Applies removals while `pays` returns true. Never removes the last triangle.
  template <typename Pays>
  Pruned take(Pays&& pays) {
    std::stable_sort(all_.begin(), all_.end(), [](const Removal& a, const Removal& b) { return a.each() < b.each(); });
    for (const Removal& r : all_) {
      if (r.whole && (left_ == 1 || is_leant_on(r.triangle))) continue;
      if (!pays(r)) break;
      if (r.whole)
        remove(r.triangle);
      else
        coarser_[r.triangle] = true;
    }
    Pruned pruned;
    for (std::uint32_t t = 0; t < table_.size(); ++t) {
      if (goes_[t]) continue;
      const std::uint32_t finest = table_[t].level_max - (coarser_[t] ? 1 : 0);
      pruned.kept.push_back(t);
      pruned.levels.push_back({std::min(table_[t].level_min, finest), finest});
    }
    return pruned;
  }

 private:
  std::span<const std::pair<std::uint32_t, std::uint32_t>> behind(std::uint32_t t) const {
    const auto less = [](const auto& a, const auto& b) { return a.first < b.first; };
    const auto [begin, end] = std::equal_range(behind_.begin(), behind_.end(), std::pair(t, 0u), less);
    return {begin, end};
  }
  bool is_leant_on(std::uint32_t t) const {
    if (behind_.empty()) return false;
    const auto pairs = behind(t);
    return stands_in_[t] ||
           std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) { return goes_[pair.second]; });
  }
  void remove(std::uint32_t t) {
    goes_[t] = true, --left_;
    for (const auto& pair : behind(t)) stands_in_[pair.second] = true;
  }

  std::span<const soup::TextureEntry> table_;
  std::span<const std::pair<std::uint32_t, std::uint32_t>> behind_;
  std::vector<Removal> all_;
  std::vector<bool> goes_, coarser_, stands_in_;
  std::size_t left_;
};

double samples_of(std::span<const soup::TextureEntry> table) {
  double samples = 0;
  for (const soup::TextureEntry& row : table) samples += soup::samples_at(row.level_max) + kTriangleInSamples;
  return samples;
}

}  // namespace

Pruned pruned_to_knee(const Importance& importance, std::span<const soup::TextureEntry> table,
                      const std::vector<bool>& backdrop, double knee) {
  Removals removals(table);
  removals.keep_stand_ins(importance);
  for (std::uint32_t t = 0; t < table.size(); ++t)
    if (importance.pixels[t] > 0)
      if (const auto removal = cheaper(importance, table[t], t, backdrop[t])) removals.add(*removal);
  // Stop at d(10 log10 error) / d(log2 samples) = -knee, with error and samples after the removals so far.
  const double share = knee * std::log(10.0) / (10.0 * std::log(2.0));
  double error = importance.error, samples = samples_of(table);
  return removals.take([&](const Removal& r) {
    if (r.each() > share * error / samples) return false;
    error += r.loss, samples -= r.saves;
    return true;
  });
}

Pruned least_important_removed(const Importance& importance, std::span<const soup::TextureEntry> table,
                               const std::vector<bool>& backdrop, const Shares& shares) {
  const bool triangles = shares.triangles < 1;
  Removals removals(table);
  for (std::uint32_t t = 0; t < table.size(); ++t) {
    if (triangles && !backdrop[t]) removals.add({std::max(0.0, importance.triangle[t]), 1, t, true});
    if (!triangles)
      if (const auto removal = cheaper(importance, table[t], t, backdrop[t])) removals.add(*removal);
  }
  const double to_save =
      triangles ? (1 - shares.triangles) * double(table.size()) : (1 - shares.bytes) * samples_of(table);
  double saved = 0;
  return removals.take([&](const Removal& r) {
    if (saved >= to_save) return false;
    saved += r.saves;
    return true;
  });
}

bool takes_away(const Pruned& pruned, std::span<const soup::TextureEntry> table) {
  return pruned.kept.size() < table.size() ||
         !std::equal(table.begin(), table.end(), pruned.levels.begin(),
                     [](const auto& row, const auto& level) { return row.level_max == level.level_max; });
}

/// Largest number of rounds after the last step.
constexpr std::size_t kMostRounds = 24;

bool has_goal(const Settings& s) {
  return s.target_psnr > 0 || s.target_ssim > 0 || s.max_bytes > 0 || s.max_triangles > 0;
}

bool meets(const Round& r, const Settings& s) { return above(r, s) >= 0 && too_large(r, s) <= 1; }

std::optional<NextRound> next_round(std::span<const Round> rounds, const Settings& s) {
  const Round& last = rounds.back();
  const std::size_t from = rounds.size() - 1;
  const bool quality = s.target_psnr > 0 || s.target_ssim > 0;
  if (rounds.size() > kMostRounds) return std::nullopt;
  if (const double factor = too_large(last, s); factor > 1) {
    // Remove at most half per round, because each round measures the importance again.
    Shares shares;
    if (s.max_triangles > 0 && double(last.triangles) > s.max_triangles)
      shares.triangles = std::max(0.5, double(s.max_triangles) / last.triangles);
    else
      shares.bytes = std::max(0.5, 0.99 * double(s.max_bytes) / double(last.bytes));
    return NextRound{from, shares};
  }
  if (!quality) return std::nullopt;
  const double margin = above(last, s);
  if (margin >= 0) return towards_quality(rounds, from, s);
  // After a removal, train one more round to recover the loss; continue while the expected gain reaches the quality.
  const double gain = margin - above(rounds[last.from], s);
  if (margin > -kNear && (last.smaller || margin + kNextGain * gain > 0)) return NextRound{from, {}};
  const std::size_t best = best_round(rounds, s);
  if (!meets(rounds[best], s) || returns(rounds) == kMostReturns) return std::nullopt;
  return towards_quality(rounds, best, s);
}

std::size_t best_round(std::span<const Round> rounds, const Settings& s) {
  std::size_t best = 0;
  const auto better = [&](const Round& a, const Round& b) {
    if (meets(a, s) != meets(b, s)) return meets(a, s);
    if (meets(a, s)) {
      // With goals of size only, prefer the better quality.
      if (s.target_psnr <= 0 && s.target_ssim <= 0) return a.psnr > b.psnr;
      return a.bytes < b.bytes;
    }
    const double size_a = std::max(1.0, too_large(a, s)), size_b = std::max(1.0, too_large(b, s));
    return size_a != size_b ? size_a < size_b : above(a, s) > above(b, s);
  };
  for (std::size_t i = 1; i < rounds.size(); ++i)
    if (better(rounds[i], rounds[best])) best = i;
  return best;
}

std::string outcome(std::span<const Round> rounds, const Settings& s) {
  const std::size_t best = best_round(rounds, s);
  const Round& r = rounds[best];
  std::string text = fmt::format("goal {}: {} triangles, {:.2f} MB", meets(r, s) ? "met" : "missed", r.triangles,
                                 1e-6 * double(r.bytes));
  if (s.validation_views > 0)
    text += fmt::format(", PSNR {:.2f} dB, SSIM {:.4f} over {} validation views", r.psnr, r.ssim, s.validation_views);
  if (meets(r, s)) return text;
  if (too_large(r, s) > 1)
    return text + (rounds.size() > kMostRounds
                       ? "; no more rounds to shrink it; use fewer `triangles`"
                       : "; nothing more can be removed: one triangle and the backdrop always stay");
  if (too_large(rounds.front(), s) > 1)
    return text + "; the size limit allows no better quality; use a larger `max_bytes` or `max_triangles`";
  if (best == 0)
    return text +
           "; the training ended below it; train with more `steps`, more `triangles` or larger photographs (a smaller "
           "`resolution`)";
  return text;
}

nlohmann::json to_json(std::span<const Round> rounds) {
  nlohmann::json json = nlohmann::json::array();
  for (const Round& r : rounds)
    json.push_back({{"step", r.step},
                    {"bytes", r.bytes},
                    {"triangles", r.triangles},
                    {"validation_psnr", r.psnr},
                    {"validation_ssim", r.ssim},
                    {"from", r.from},
                    {"smaller", r.smaller}});
  return json;
}

std::vector<Round> rounds_from_json(const nlohmann::json& json) {
  std::vector<Round> rounds;
  try {
    for (const nlohmann::json& r : json)
      rounds.push_back({r.at("step").get<std::uint64_t>(), r.at("bytes").get<std::uint64_t>(),
                        r.at("triangles").get<std::uint32_t>(), r.at("validation_psnr").get<double>(),
                        r.at("validation_ssim").get<double>(), r.at("from").get<std::size_t>(),
                        r.at("smaller").get<bool>()});
    for (std::size_t i = 0; i < rounds.size(); ++i)
      if (rounds[i].from > (i > 0 ? i - 1 : 0))
        throw Error("rounds: round {} cannot start from round {}; the file is damaged", i, rounds[i].from);
  } catch (const nlohmann::json::exception& e) {
    throw Error("rounds: {}", e.what());
  }
  return rounds;
}

}  // namespace trisoup::train
