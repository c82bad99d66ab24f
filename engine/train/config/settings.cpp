#include "train/config/settings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "soup/soup.h"
#include "train/config/experiments.h"

namespace trisoup::train {
namespace {

/// Calls f(name, member) for every member: the one list from which JSON is written and read.
template <typename S, typename F>
void each_member(S& s, F&& f) {
  f("steps", s.steps);
  f("triangles", s.triangles);
  f("batch", s.batch);
  f("seed", s.seed);
  f("init", s.init);
  f("init_count", s.init_count);
  f("init_centre", s.init_centre);
  f("init_box", s.init_box);
  f("init_radius", s.init_radius);
  f("init_opacity", s.init_opacity);
  f("backdrop", s.backdrop);
  f("rate_texture", s.rate_texture);
  f("rate_mlp", s.rate_mlp);
  f("rate_vertex", s.rate_vertex);
  f("rate_end", s.rate_end);
  f("rate_vertex_end", s.rate_vertex_end);
  f("rest_share", s.rest_share);
  f("huber", s.huber);
  f("texture_bits", s.texture_bits);
  f("coarse_level", s.coarse_level);
  f("level_min", s.level_min);
  f("level_max", s.level_max);
  f("samples_per_pixel", s.samples_per_pixel);
  f("pixel_jitter", s.pixel_jitter);
  f("coarse_share", s.coarse_share);
  f("small_share", s.small_share);
  f("small_scale", s.small_scale);
  f("paint", s.paint);
  f("keep_opacity", s.keep_opacity);
  f("keep_moments", s.keep_moments);
  f("exposure", s.exposure);
  f("opaque", s.opaque);
  f("copy_textures", s.copy_textures);
  f("drop_near", s.drop_near);
  f("opacity_baseline", s.opacity_baseline);
  f("update_unseen", s.update_unseen);
  f("resample_every", s.resample_every);
  f("resample_until", s.resample_until);
  f("split_views", s.split_views);
  f("split_length", s.split_length);
  f("fill_budget", s.fill_budget);
  f("least_views", s.least_views);
  f("most_triangles", s.most_triangles);
  f("count_scale", s.count_scale);
  f("knee", s.knee);
  f("target_psnr", s.target_psnr);
  f("target_ssim", s.target_ssim);
  f("max_bytes", s.max_bytes);
  f("max_triangles", s.max_triangles);
  f("validation_views", s.validation_views);
  f("round_steps", s.round_steps);
  f("most_rounds", s.most_rounds);
  f("near", s.near);
  f("far", s.far);
  f("test_near", s.test_near);
  f("eval_every", s.eval_every);
  f("checkpoint_every", s.checkpoint_every);
}

/// Of the vertices' rate, at a share t of all steps.
double still_to_go(const Settings& s, double t) {
  return s.rest_share > 0 ? std::min(1.0, (1 - t) / s.rest_share) : 1.0;
}

/// How far the schedule is after `step` steps, 0..1. Each round after the last step goes through its end once more.
double progress(const Settings& s, double step) {
  constexpr double kAgain = 0.3;
  const auto steps = static_cast<double>(s.steps), round = static_cast<double>(s.round_steps);
  if (step <= steps || s.round_steps == 0) return step / steps;
  const double done = std::fmod(step - steps, round);
  return 1 - kAgain * (1 - (done == 0 ? 1 : done / round));
}

}  // namespace

const char* to_string(Recipe recipe) { return recipe == Recipe::synthetic ? "synthetic" : "real"; }

Settings published(Recipe recipe) {
  Settings s;
  s.recipe = recipe;
  if (recipe == Recipe::synthetic) {
    s.init = "random";
    s.init_count = 100'000;
  } else {
    s.init = "points";
    s.init_count = 15'000;
    s.rate_vertex = 2.5e-3;
    s.near = 0.0025;
    s.far = 100.0;  // in a world without bounds far is only where depth ends
    s.test_near = 0.125;
  }
  return s;
}

Settings without_our_changes(Settings s) {
  s.samples_per_pixel = 0;
  s.pixel_jitter = 0;
  s.small_scale = 1;
  s.small_share = 0;
  s.huber = 0;
  s.texture_bits = 8;
  s.knee = 0;
  s.opacity_baseline = false;
  s.update_unseen = true;
  s.copy_textures = true;
  s.drop_near = true;
  s.least_views = 0;
  s.exposure = false;
  s.rest_share = 0;
  s.paint = false;
  return s;
}

double vertex_rate(const Settings& s, double way, double fastest) {
  const double end = s.rate_vertex_end;
  if (!(end > 0)) return fastest;  // check() has a word on that
  // The mean of end^t over t from 0 to 1, and of what is left of it while vertices come to rest.
  double mean = end == 1 ? 1.0 : (1 - end) / -std::log(end);
  if (s.rest_share > 0) {
    constexpr int kParts = 1000;
    mean = 0;
    for (int i = 0; i < kParts; ++i) {
      const double t = (i + 0.5) / kParts;
      mean += std::pow(end, t) * still_to_go(s, t) / kParts;
    }
  }
  return std::min(way / (mean * static_cast<double>(std::max<std::uint64_t>(s.steps, 1))), fastest);
}

double published_way(Recipe recipe) { return recipe == Recipe::synthetic ? 0.537 : 5.37; }

double rate_factor(const Settings& s, double end, std::uint64_t step) {
  return std::pow(end, progress(s, static_cast<double>(step)));
}

double vertex_rate_factor(const Settings& s, std::uint64_t step) {
  return rate_factor(s, s.rate_vertex_end, step) * still_to_go(s, progress(s, static_cast<double>(step) - 0.5));
}

std::uint64_t lift_step(const Settings& s) {
  return static_cast<std::uint64_t>(std::llround(s.coarse_share * static_cast<double>(s.steps)));
}

std::uint64_t small_end(const Settings& s) {
  return std::max(lift_step(s), static_cast<std::uint64_t>(std::llround(s.small_share * static_cast<double>(s.steps))));
}

std::uint64_t next_evaluation(std::uint32_t per_decade, std::uint64_t step) {
  if (per_decade == 0) return 0;
  // Two may round to the same step.
  for (std::uint32_t i = 0;; ++i)
    if (const auto at = static_cast<std::uint64_t>(std::llround(std::pow(10.0, 1.0 + double(i) / per_decade)));
        at > step)
      return at;
}

/// The steps after which the soup is brought to its knee, as shares of all. What is left has the rest of them to get
/// over it.
constexpr std::array kPrunings = {0.7, 0.8, 0.9};

/// The last step that may change the topology by the budget.
double last_by_budget(const Settings& s) {
  const auto steps = static_cast<double>(s.steps);
  // Splits would fill up what the knee has left empty.
  return s.knee > 0 ? std::min(s.resample_until * steps, kPrunings.front() * steps - 1)
                    : s.resample_until * steps + 1e-9;
}

std::uint64_t only_resampling(const Settings& s) {
  const double until = last_by_budget(s);
  const bool too_short =
      s.resample_every > 0 && (static_cast<double>(s.resample_every) > until || s.resample_every >= s.steps);
  // Half of the time to get over it.
  return too_short && s.init_count > s.triangles ? static_cast<std::uint64_t>(until / 2) : 0;
}

bool is_resampling(const Settings& s, std::uint64_t step) {
  if (s.resample_every == 0 || step == 0 || step >= s.steps) return false;
  return step == only_resampling(s) || (step % s.resample_every == 0 && static_cast<double>(step) <= last_by_budget(s));
}

bool is_last_resampling(const Settings& s, std::uint64_t step) {
  return is_resampling(s, step) && !is_resampling(s, step + s.resample_every);
}

std::uint64_t next_pruning(const Settings& s, std::uint64_t step) {
  if (s.knee <= 0) return 0;
  // What fine levels are worth shows when there are some.
  for (const double share : kPrunings)
    if (const auto at = static_cast<std::uint64_t>(std::llround(share * static_cast<double>(s.steps)));
        at > step && at > lift_step(s) && at < s.steps)
      return at;
  return 0;
}

Settings prolonged(Settings s, std::uint64_t step, std::uint64_t steps) {
  if (steps <= s.steps) return s;
  const auto share_of = [&](std::uint64_t then) { return static_cast<double>(then) / static_cast<double>(steps); };
  // What is over does not come again: twice would take the fine textures for coarse ones.
  const std::uint64_t lift = lift_step(s), small = small_end(s);
  if (step >= lift) s.coarse_share = share_of(lift);
  if (step >= small && s.small_share > 0) s.small_share = share_of(small);
  s.steps = steps;
  return s;
}

std::string differences(const Settings& then, const Settings& now) {
  const nlohmann::json before = to_json(then), after = to_json(now);
  std::string text;
  for (const auto& [key, value] : after.items())
    if (before.at(key) != value)
      text += fmt::format("{}{} {} (now {})", text.empty() ? "" : ", ", key, before.at(key).dump(), value.dump());
  return text;
}

void check(const Settings& s) {
  const auto need = [](bool ok, const char* what) {
    if (!ok) throw Error("settings: {}", what);
  };
  // The comparisons below let infinity pass, and some of them NaN.
  each_member(s, [&](const char* name, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>)
      // Kernels compute in float: what it cannot hold would only show as a training that diverges.
      if (!(std::abs(value) < 1e37) || (value != 0 && std::abs(value) < 1e-37))
        throw Error("settings: {} is not a number of a size that can be computed with",
                    as_given(name, fmt::format("{}", value)));
  });
  for (const Experiment& e : experiments())
    if (!e.range.has(e.value(s)))
      throw Error("settings: {} must be {}", as_given(e.name, fmt::format("{}", e.value(s))), allowed(e));
  need(s.steps > 0, "--steps 0 trains nothing; use 1 or more");
  need(s.triangles > 0, "--triangles 0 leaves no model; use a budget of 1 or more");
  need(s.init_count > 0, "--init-count 0 starts with nothing; use 1 or more");
  need(s.level_max <= static_cast<std::uint32_t>(soup::kMaxLevel), "texture levels end at 5; lower --level-max");
  need(s.level_min <= s.level_max, "--set level_min is above --level-max; give them in order");
  need(s.knee >= 0 && s.knee <= 10, "--knee must be within 0 and 10 dB");
  need(s.texture_bits >= 1 && s.texture_bits <= 8, "--texture-bits must be within 1 and 8: a byte has no more");
  need(s.near > 0 && s.far > s.near, "0 < --near < --far must hold");
  need(s.test_near > 0 && s.far > s.test_near, "0 < --test-near < --far must hold");
  need(s.init_box > 0 && s.init_radius > 0, "--init-box and --init-radius must be above 0");
  need(s.backdrop < s.far, "--set backdrop is not before --far; lower it");
  need(s.most_triangles == 0 || s.most_triangles >= s.triangles,
       "--set most_triangles is below --triangles; use at least the budget");
  need(s.target_psnr >= 0 && s.target_psnr <= 99, "--target-psnr must be within 0 and 99 dB");
  need(s.target_ssim >= 0 && s.target_ssim < 1, "--target-ssim must be from 0 to below 1");
  need(s.round_steps > 0 || (s.target_psnr == 0 && s.target_ssim == 0 && s.max_bytes == 0 && s.max_triangles == 0),
       "--round-steps 0 leaves no step after a removal; use 1 or more");
  need(s.round_steps <= 1'000'000'000, "--round-steps is more than a billion; use fewer");
  need(s.validation_views > 0 || (s.target_psnr == 0 && s.target_ssim == 0),
       "--validation-views 0 leaves nothing to judge a quality by; use 1 or more");
}

nlohmann::json to_json(const Settings& settings) {
  nlohmann::json json;
  json["recipe"] = to_string(settings.recipe);
  each_member(settings, [&](const char* name, const auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, std::string>)
      json[name] = utf8(value);
    else
      json[name] = value;
  });
  return json;
}

Settings settings_from_json(const nlohmann::json& json) {
  Settings s;
  try {
    s.recipe = json.at("recipe").get<std::string>() == "synthetic" ? Recipe::synthetic : Recipe::real;
    each_member(s, [&](const char* name, auto& value) {
      const nlohmann::json& given = json.at(name);
      // nlohmann turns -1 and 2.5 into whole numbers without a word.
      using T = std::remove_cvref_t<decltype(value)>;
      if constexpr (std::is_unsigned_v<T> && !std::is_same_v<T, bool>)
        if (!given.is_number_unsigned() || given.get<std::uint64_t>() > std::numeric_limits<T>::max())
          throw Error("settings: {} is {}, not a whole number from 0 to {}", name, printable(given.dump()),
                      std::numeric_limits<T>::max());
      given.get_to(value);
    });
  } catch (const nlohmann::json::exception& e) {
    throw Error("settings: {}", e.what());
  }
  return s;
}

}  // namespace trisoup::train
