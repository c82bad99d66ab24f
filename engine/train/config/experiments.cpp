#include "train/config/experiments.h"

#include <algorithm>
#include <charconv>
#include <numeric>
#include <string_view>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "soup/soup.h"

namespace trisoup::train {
namespace {

constexpr Range kAny{}, kAboveNothing{.low = 0, .without_low = true}, kShare{0, 1}, kLevel{0, double(soup::kMaxLevel)};
using S = Settings;

constexpr Experiment kExperiments[] = {
    {"Start",
     "init_opacity",
     &S::init_opacity,
     {0, 1, true, true},
     "opacity of all triangles",
     "0.5; from a surface 0.9"},
    {"Start", "backdrop", &S::backdrop, kAny,
     "radius of a sphere of 80 triangles around all else that always stays, normalised units; 0: none",
     "0; from a surface three times as far as the farthest point"},
    {"Start",
     "paint",
     &S::paint,
     {},
     "a surface has the photographs' colours in its fine levels, where there is no coarse part",
     "false; from a surface true; published false"},

    {"Steps", "batch", &S::batch, {1}, "views per step", "4"},
    {"Steps",
     "pixel_jitter",
     &S::pixel_jitter,
     {0, 0.5},
     "steps look at pictures so many pixels beside the centres of pixels, at most, along each axis",
     "0.25; published 0"},
    {"Steps", "small_share", &S::small_share, kShare,
     "share of the steps, the first ones, that look at smaller pictures; the coarse part does so anyway",
     "0; from a surface 0.75 where photographs are large"},
    {"Steps",
     "small_scale",
     &S::small_scale,
     {0, 1, true},
     "sides of these pictures, as a share of the photographs'",
     "0.5; published 1"},
    {"Steps", "huber", &S::huber, kAny, "errors of colours below it pull in proportion to their size; 0: all alike",
     "0.1; published 0"},
    {"Steps",
     "drop_near",
     &S::drop_near,
     {},
     "triangles that reach the camera plane are dropped whole, not clipped",
     "false; published true"},

    {"Rates", "rate_texture", &S::rate_texture, kAny, "learning rate of textures", "0.05; from a surface 0.1"},
    {"Rates", "rate_mlp", &S::rate_mlp, kAny, "learning rate of the MLP", "0.01"},
    {"Rates", "rate_vertex", &S::rate_vertex, kAny, "learning rate of vertices, normalised units",
     "what lets vertices travel far enough (docs/method.md, Units)"},
    {"Rates", "rate_end", &S::rate_end, kAboveNothing, "all rates fall exponentially to this share",
     "0.1; published 0.01"},
    {"Rates", "rate_vertex_end", &S::rate_vertex_end, kAboveNothing, "the rate of vertices falls to this share instead",
     "as rate_end; without it from a surface 0.03"},
    {"Rates", "rest_share", &S::rest_share, kShare, "share of the steps, the last ones, in which vertices come to rest",
     "0; from a surface 0.2"},

    {"Textures", "coarse_share", &S::coarse_share, kShare,
     "share of the steps, the first ones, on coarse_level alone; 0: fine levels from the first step on",
     "0.5; from a surface 0"},
    {"Textures", "coarse_level", &S::coarse_level, kLevel, "texture level of the coarse part", "0"},
    {"Textures", "level_min", &S::level_min, kLevel,
     "coarsest texture level after it; that of --level-max: the finest level alone", "2"},
    {"Textures", "samples_per_pixel", &S::samples_per_pixel, kAny,
     "samples of a finest level for each pixel of the photograph that shows it largest; 0: --level-max for all",
     "1; published 0"},
    {"Textures",
     "copy_textures",
     &S::copy_textures,
     {},
     "halves of a split triangle copy its texture, not their part of it",
     "false; published true"},
    {"Textures",
     "update_unseen",
     &S::update_unseen,
     {},
     "values of textures without a gradient in a step go on by their moments",
     "false; published true"},
    {"Textures",
     "keep_moments",
     &S::keep_moments,
     {},
     "textures keep their optimiser's moments through changes of topology",
     "false"},

    {"Opacity",
     "opaque",
     &S::opaque,
     {},
     "opacity fixed to 1: no masking in training, and every triangle opaque in the model",
     "false"},
    {"Opacity",
     "keep_opacity",
     &S::keep_opacity,
     {},
     "opacity does not start again when the levels change",
     "false; from a surface true"},
    {"Opacity",
     "opacity_baseline",
     &S::opacity_baseline,
     {},
     "opacities learn from how a pixel's error differs from its neighbours', not from the error alone",
     "true; published false"},

    {"Topology", "resample_every", &S::resample_every, kAny, "steps between changes of topology; 0: none",
     "1 % of the steps, at least 100"},
    {"Topology", "resample_until", &S::resample_until, kShare, "share of the steps after which topology stays",
     "0.95; from a surface 0.5"},
    {"Topology",
     "count_scale",
     &S::count_scale,
     {0, 1, true},
     "size of the pictures in which visible pixels are counted, as a share of the photographs'",
     "0.5"},
    {"Topology", "split_views", &S::split_views, kAny, "real: views in which edges are measured", "20"},
    {"Topology", "split_length", &S::split_length, kAboveNothing,
     "real: longest edge as a share of the picture's height", "0.2"},
    {"Topology",
     "fill_budget",
     &S::fill_budget,
     {},
     "real: the triangles that photographs show largest are split until there are --triangles",
     "false; from a surface true"},
    {"Topology", "least_views", &S::least_views, kAny,
     "real: triangles that fewer training views show are dropped; at most a tenth of the views", "4; published 0"},
    {"Topology", "most_triangles", &S::most_triangles, kAny,
     "real: how far splitting goes beyond --triangles in between; 0: as far as memory lets it",
     "up to 8 times; from a surface not at all"},

    {"Goal", "most_rounds", &S::most_rounds, kAny, "rounds of simplifying, at most", "24"},
};

/// Calls f with a value of the member's type.
template <typename F>
auto with_type(const Experiment& e, F&& f) {
  return std::visit([&]<typename T>(T Settings::*) { return f(T{}); }, e.member);
}

/// Letters to take out, put in or change (Levenshtein).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

template <typename T>
bool read_number(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool read_value(const Experiment& e, const std::string& text, double& value) {
  return with_type(e, [&]<typename T>(T) {
    if constexpr (std::is_same_v<T, bool>) {
      value = text == "true";
      return text == "true" || text == "false";
    } else {
      T number{};
      if (!read_number(text, number)) return false;
      value = static_cast<double>(number);
      // What a double cannot hold is no number of steps either.
      if (std::is_integral_v<T> && value > 9007199254740992.0) return false;
      return e.range.has(value) && value < 1e37;
    }
  });
}

}  // namespace

double Experiment::value(const Settings& s) const {
  return std::visit([&](auto pointer) { return static_cast<double>(s.*pointer); }, member);
}

std::span<const Experiment> experiments() { return kExperiments; }

const Experiment* find_experiment(const std::string& name) {
  const auto it = std::find_if(std::begin(kExperiments), std::end(kExperiments),
                               [&](const Experiment& e) { return name == e.name; });
  return it == std::end(kExperiments) ? nullptr : it;
}

std::string experiments_text() {
  std::string text;
  std::string_view subject;
  for (const Experiment& e : kExperiments) {
    if (subject != e.subject) text += fmt::format("{}\n", e.subject);
    subject = e.subject;
    text += fmt::format("  {:17} {}\n{:20}{} [{}]\n", e.name, e.what, "", allowed(e), e.usual);
  }
  return text;
}

std::string allowed(const Experiment& e) {
  return with_type(e, [&]<typename T>(T) -> std::string {
    if constexpr (std::is_same_v<T, bool>) return "true or false";
    const Range& r = e.range;
    const char* const kind = std::is_integral_v<T> ? "a whole number" : "a number";
    const bool bounded = r.high < std::numeric_limits<double>::infinity();
    if (r.without_low)
      return fmt::format("{} above {}{}", kind, r.low,
                         !bounded ? "" : fmt::format(" and {} {}", r.without_high ? "below" : "at most", r.high));
    return bounded ? fmt::format("{} from {} to {}", kind, r.low, r.high) : fmt::format("{} from {} on", kind, r.low);
  });
}

std::string as_given(const std::string& name, const std::string& value) {
  if (find_experiment(name)) return fmt::format("--set {}={}", name, value);
  if (name == "max_bytes") return "--max-mb";
  if (name == "init_centre") return "--init-box";
  std::string option = "--" + name;
  std::replace(option.begin(), option.end(), '_', '-');
  return value.empty() ? option : option + " " + value;
}

std::string nearest_setting(const std::string& name) {
  std::string nearest;
  const nlohmann::json all = to_json(Settings());
  for (const auto& [known, value] : all.items())
    if (nearest.empty() || distance(name, known) < distance(name, nearest)) nearest = known;
  return nearest;
}

Assignment read_assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (equals == std::string::npos)
    throw Error("--set {}: is not name=value; soup-train --help-all lists the names", printable(text));
  const Experiment* const e = find_experiment(name);
  if (!e) {
    const std::string nearest = nearest_setting(name);
    if (nearest == name) throw Error("--set {}: has an option of its own, {}", printable(text), as_given(name, ""));
    if (find_experiment(nearest))
      throw Error("--set {}: there is no such setting; the nearest is {} (soup-train --help-all lists all)",
                  printable(text), nearest);
    throw Error("--set {}: there is no such setting; the nearest is {}, which has an option of its own, {}",
                printable(text), nearest, as_given(nearest, ""));
  }
  Assignment assignment{e};
  const std::string value = text.substr(equals + 1);
  if (read_value(*e, value, assignment.value)) return assignment;
  if (value.size() > 9 && value.find_first_not_of("0123456789") == std::string::npos)
    throw Error("--set {}: is too large", printable(text));
  throw Error("--set {}: must be {}", printable(text), allowed(*e));
}

void assign(Settings& s, const Assignment& assignment) {
  std::visit([&]<typename T>(T Settings::*member) { s.*member = static_cast<T>(assignment.value); },
             assignment.experiment->member);
}

}  // namespace trisoup::train
