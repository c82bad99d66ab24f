#include "train/config/settings_table.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <type_traits>

#include <fmt/format.h>

#include "base/edit_distance.h"
#include "base/error.h"
#include "base/printable.h"
#include "soup/soup.h"

namespace trisoup::train {
namespace {

using S = Settings;
using enum Access;

constexpr Range kAny{}, kNone{}, kFromOne{1}, kAboveZero{.low = 0, .without_low = true}, kShare{0, 1};
constexpr Range kLevel{0, double(soup::kMaxLevel)};
constexpr Range kNormalFloat{.low = 0, .high = 1e37, .without_low = true, .without_high = true};

// clang-format off
constexpr Setting kTable[] = {
    {"Common", "steps", &S::steps, option, kFromOne, "training steps; schedules scale with them",
     {.usual = 10'000, .fast = 1000, .balanced = 3000, .note = "fast from random triangles 2000 of half the views"}},
    {"Common", "triangles", &S::triangles, option, kFromOne, "budget of triangles",
     {.usual = 15'000, .fast = 2000, .balanced = 5000,
      .note = "from a surface what photographs show, half to 4 times as many"}},
    {"Common", "seed", &S::seed, option, kAny,
     "seed of all random numbers; the same seed on the same device gives the same model",
     {.usual = 0}},

    {"Goal", "target_psnr", &S::target_psnr, option, {0, 99}, "PSNR to reach, dB, mean over the validation views",
     {.note = "none"}},
    {"Goal", "target_ssim", &S::target_ssim, option, {.low = 0, .high = 1, .without_high = true},
     "SSIM to reach, mean over the validation views", {.note = "none"}},
    {"Goal", "max_bytes", &S::max_bytes, option, kAny, "size of the model file, bytes", {.note = "none"}},
    {"Goal", "max_triangles", &S::max_triangles, option, kAny, "triangles of the model", {.note = "none"}},
    {"Goal", "validation_views", &S::validation_views, option, kAny,
     "training views that are held out to measure the goal",
     {.note = "a tenth of the training views, 3 to 24, if a quality is the goal"}},
    {"Goal", "round_steps", &S::round_steps, option, {0, 1e9}, "training steps after each removal",
     {.note = "a twentieth of the steps, at least 20"}},

    {"Dataset", "near", &S::near, option, kAboveZero, "near plane of training, normalised units",
     {.note = "synthetic 0.025, real 0.0025; from a surface in front of everything that was seen"}},
    {"Dataset", "far", &S::far, option, kAboveZero, "far plane, normalised units",
     {.note = "synthetic 2.5, real 100 or beyond the farthest point"}},
    {"Dataset", "test_near", &S::test_near, option, kAboveZero, "near plane of test views, normalised units",
     {.note = "synthetic 0.025, real 0.125; from a surface that of training"}},

    {"Start", "init", &S::init, option, kNone,
     "first triangles: surface (built from sparse points), points, random, or a mesh file (.obj .ply .gltf .glb)",
     {.note = "real scenes surface, synthetic ones random; published: points if there are any"}},
    {"Start", "removed_from", &S::removed_from, option, kNone,
     "model.glb from which init was cut (soup-edit, window): pixels that show what was removed do not count",
     {.note = "none"}},
    {"Start", "init_count", &S::init_count, option, kFromOne, "triangles at the start",
     {.fast = 10'000, .balanced = 10'000,
      .note = "surface: the budget; points 15000; random 30000; published random 100000"}},
    {"Start", "least_shift", &S::least_shift, experiment, kAny,
     "mean squared shift of pixels that one more triangle of a surface must save, pixels^2; 0: all of --triangles",
     {.usual = 0.0015, .fast = 0.05, .balanced = 0.01, .published = 0, .note = "0 with --triangles"}},
    {"Start", "init_centre", &S::init_centre, internal, kNone, "centre of the box of a random start, normalised units",
     {}},
    {"Start", "init_box", &S::init_box, option, kAboveZero,
     "half the side of the box of a random start, around the dataset's origin, in its units",
     {.note = "synthetic 0.3, real 1, both in normalised units around the centre"}},
    {"Start", "init_radius", &S::init_radius, option, kAboveZero,
     "circumradius of a random start's triangles, in the dataset's units",
     {.note = "synthetic 0.0025, real 0.01, both in normalised units"}},
    {"Start", "init_opacity", &S::init_opacity, experiment, {0, 1, true, true}, "opacity of all triangles at the start",
     {.usual = 0.5, .surface = 0.9}},
    {"Start", "backdrop", &S::backdrop, experiment, kAny,
     "radius of a sphere of 80 triangles around everything else that refinement never drops, normalised units; 0: none",
     {.note = "0; from a surface three times the distance of the farthest point"}},

    {"Method", "recipe", &S::recipe, option, kNone, "how triangles are dropped and split: synthetic or real",
     {.note = "by photographs, points and cameras (docs/datasets.md)"}},
    {"Method", "published", &S::published, internal, kNone,
     "do as the publication does wherever this project's method differs from it", {.usual = false, .published = true}},
    {"Method", "level_max", &S::level_max, option, kLevel, "finest texture level", {.usual = 5, .fast = 4,
     .balanced = 4}},
    {"Method", "texture_bits", &S::texture_bits, option, {1, 8},
     "bits of each texture value in the model file; 8: exact",
     {.usual = 6, .published = 8}},
    {"Method", "knee", &S::knee, option, {0, 10},
     "dB; triangles and finest texture levels are pruned if twice their samples would gain less; 0: no pruning",
     {.usual = 0.2, .published = 0, .note = "0.05 with a PSNR or SSIM to reach"}},
    {"Method", "exposure", &S::exposure, option, kNone,
     "finds an exposure of each photograph, for captures with automatic exposure or white balance",
     {.note = "true for real scenes, false for synthetic ones; published false"}},
    {"Method", "pose_corrections", &S::pose_corrections, option, kNone,
     "corrects poses of training photographs that are a little off",
     {.note = "true for real scenes unless points of the dataset fit within half a pixel"}},

    {"Steps", "batch", &S::batch, experiment, kFromOne, "views per step", {.usual = 4,
     .note = "fast from random triangles 2"}},
    {"Steps", "pixel_jitter", &S::pixel_jitter, experiment, {0, 0.5},
     "largest distance of samples from pixel centres, pixels along each axis", {.usual = 0.25, .published = 0}},
    {"Steps", "random_background", &S::random_background, experiment, kShare,
     "share of the views that steps see on a random background instead of `background`, if photographs have alpha",
     {.usual = 0.2, .published = 0}},
    {"Steps", "neighbour_directions", &S::neighbour_directions, experiment, kShare,
     "share of the views that steps shade with the view directions of one of the two nearest cameras",
     {.usual = 0, .surface = 0.3}},
    {"Steps", "small_share", &S::small_share, experiment, kShare,
     "first share of the steps, which trains on pictures with half the sides, as the coarse part does",
     {.usual = 0, .note = "from a surface 0.75 if photographs are large"}},
    {"Steps", "pose_motion", &S::pose_motion, experiment, kAny,
     "median motion of the first corrections of poses, pixels; if it is smaller there are none",
     {.usual = 0.25, .note = "0 if pose_corrections is given"}},
    {"Steps", "pose_every", &S::pose_every, internal, kAny, "steps between corrections of poses; 0: none",
     {.note = "as many as show every photograph, at least 1 % of the steps"}},
    {"Steps", "huber", &S::huber, experiment, kAny,
     "colour errors below it have a gradient in proportion to them; 0: L1",
     {.usual = 0.1, .published = 0}},
    {"Steps", "lambda_depth", &S::lambda_depth, experiment, kAny,
     "weight of the depth loss at the first step, if there are depth maps; 0: none", {.usual = 1, .published = 0}},
    {"Steps", "depth_until", &S::depth_until, experiment, kShare,
     "share of the steps after which the weight of the depth loss has fallen to 0", {.usual = 0.7}},

    {"Learning rates", "lr_texture", &S::lr_texture, experiment, kAny, "learning rate of textures", {.usual = 0.05,
     .surface = 0.1}},
    {"Learning rates", "lr_mlp", &S::lr_mlp, experiment, kAny, "learning rate of the MLP", {.usual = 0.01}},
    {"Learning rates", "lr_vertex", &S::lr_vertex, experiment, kAny, "learning rate of vertices, normalised units",
     {.note = "lets vertices travel far enough (docs/method.md, Units)"}},
    {"Learning rates", "lr_end", &S::lr_end, experiment, kAboveZero,
     "learning rates at the last step, as a share of the first",
     {.usual = 0.1, .published = 0.01}},
    {"Learning rates", "lr_vertex_end", &S::lr_vertex_end, experiment, kAboveZero, "the same for vertices",
     {.usual = 0.1, .published = 0.01, .surface = 0.03, .note = "lr_end if that is given"}},
    {"Learning rates", "lr_vertex_side", &S::lr_vertex_side, experiment, kAny,
     "vertices of triangles with a smaller side have a learning rate in proportion to it; 0: none has",
     {.usual = 0, .surface = 0.1}},
    {"Learning rates", "lr_vertex_distance", &S::lr_vertex_distance, experiment, kAny,
     "the same for vertices nearer than this to a camera; 0: none has",
     {.usual = 0, .surface = 0.5}},

    {"Textures", "coarse_share", &S::coarse_share, experiment, kShare,
     "first share of the steps, which trains textures of level 0 alone; 0: fine levels from the first step on",
     {.usual = 0.5, .surface = 0}},
    {"Textures", "level_min", &S::level_min, experiment, kLevel,
     "coarsest texture level after the coarse part; level_max: the finest level alone", {.usual = 2}},
    {"Textures", "samples_per_pixel", &S::samples_per_pixel, experiment, kAny,
     "samples of the finest level for each pixel of the photograph that shows a triangle largest; 0: level_max for all",
     {.usual = 1, .published = 0}},
    {"Textures", "opaque", &S::opaque, experiment, kNone, "opacity is fixed to 1: no masking, every triangle is opaque",
     {.usual = false}},

    {"Refinement", "refine_every", &S::refine_every, experiment, kAny, "steps between refinements; 0: none",
     {.note = "1 % of the steps, from a surface 10 %; at least 100"}},
    {"Refinement", "refine_until", &S::refine_until, experiment, kShare,
     "share of the steps after which refinement ends",
     {.usual = 0.95, .surface = 0.5}},
    {"Refinement", "split_length", &S::split_length, experiment, kAboveZero,
     "longest edge as a share of the image height (real scenes)", {.usual = 0.2}},
    {"Refinement", "most_triangles", &S::most_triangles, experiment, kAny,
     "ceiling of splits beyond the budget (real scenes); 0: what fits in memory",
     {.note = "up to 8 times the budget; from a surface the budget"}},

    {"Output", "eval_every", &S::eval_every, option, kAny,
     "steps between evaluations of the test views; 0: at the end only", {.usual = 0}},
    {"Output", "checkpoint_every", &S::checkpoint_every, option, kAny, "steps between checkpoints", {.usual = 1000}},
};
// clang-format on

/// Calls f with a pointer to the member, whose type tells the setting's.
template <typename F>
auto with_member(const Setting& setting, F&& f) {
  return std::visit(std::forward<F>(f), setting.member);
}

template <typename T>
constexpr bool kIsWhole = std::is_integral_v<T> && !std::is_same_v<T, bool>;
template <typename T>
constexpr bool kIsNumber = kIsWhole<T> || std::is_same_v<T, double>;

template <typename T>
std::optional<T> read_number(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<bool> read_bool(const std::string& text) {
  for (const char* yes : {"true", "1", "on", "yes"})
    if (text == yes) return true;
  for (const char* no : {"false", "0", "off", "no"})
    if (text == no) return false;
  return std::nullopt;
}

/// No value if `text` is none of the setting's type or is out of its range.
std::optional<SettingValue> parse_value(const Setting& setting, const std::string& text) {
  return with_member(setting, [&]<typename T>(T Settings::*) -> std::optional<SettingValue> {
    if constexpr (std::is_same_v<T, bool>) {
      if (const auto value = read_bool(text)) return *value;
    } else if constexpr (kIsWhole<T>) {
      const auto value = read_number<T>(text);
      if (value && setting.range.has(static_cast<double>(*value))) return std::uint64_t{*value};
    } else if constexpr (std::is_same_v<T, double>) {
      const auto value = read_number<double>(text);
      if (value && setting.range.has(*value) && (*value == 0 || kNormalFloat.has(std::abs(*value)))) return *value;
    } else if constexpr (std::is_same_v<T, Recipe>) {
      if (text == "synthetic" || text == "real") return text;
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (!text.empty()) return text;
    }
    return std::nullopt;
  });
}

std::string column_text(const Setting& setting, double value) {
  return with_member(setting, [&]<typename T>(T Settings::*) -> std::string {
    if constexpr (std::is_same_v<T, bool>) return value != 0 ? "true" : "false";
    return fmt::format("{}", value);
  });
}

std::optional<double> value_in(const Defaults& d, Column column) {
  switch (column) {
    case Column::usual:
      return d.usual;
    case Column::fast:
      return d.fast;
    case Column::balanced:
      return d.balanced;
    case Column::published:
      return d.published;
    case Column::surface:
      return d.surface;
  }
  return std::nullopt;
}

}  // namespace

std::span<const Setting> settings_table() { return kTable; }

const Setting* find_setting(std::string_view name) {
  const auto it = std::find_if(std::begin(kTable), std::end(kTable), [&](const Setting& s) { return name == s.name; });
  return it == std::end(kTable) ? nullptr : it;
}

const char* nearest_setting(std::string_view name) {
  return std::min_element(std::begin(kTable), std::end(kTable),
                          [&](const Setting& a, const Setting& b) {
                            return edit_distance(name, a.name) < edit_distance(name, b.name);
                          })
      ->name;
}

std::string allowed_values(const Setting& setting) {
  return with_member(setting, [&]<typename T>(T Settings::*) -> std::string {
    if constexpr (std::is_same_v<T, bool>) return "true or false";
    if constexpr (std::is_same_v<T, Recipe>) return "synthetic or real";
    if constexpr (!kIsNumber<T>) return "text";
    const Range& r = setting.range;
    const char* const kind = kIsWhole<T> ? "a whole number" : "a number";
    const bool bounded = r.high < std::numeric_limits<double>::infinity();
    if (r.without_low)
      return fmt::format("{} above {}{}", kind, r.low,
                         !bounded ? "" : fmt::format(" and {} {}", r.without_high ? "below" : "at most", r.high));
    if (!bounded) return fmt::format("{} from {} on", kind, r.low);
    return fmt::format("{} from {} to {}{}", kind, r.low, r.without_high ? "below " : "", r.high);
  });
}

std::string default_values(const Setting& setting) {
  const Defaults& d = setting.defaults;
  std::string own;
  const auto add = [&](const char* preset, const std::optional<double>& value) {
    if (value) own += fmt::format("{}{} {}", own.empty() ? "" : ", ", preset, column_text(setting, *value));
  };
  add("fast", d.fast);
  add("balanced", d.balanced);
  add("published", d.published);
  add("from a surface", d.surface);
  std::string text = d.usual ? column_text(setting, *d.usual) : "";
  for (const std::string& part : {own, std::string(d.note)})
    if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
  return text;
}

Assignment read_value(const Setting& setting, const std::string& text) {
  if (auto value = parse_value(setting, text)) return {&setting, *std::move(value)};
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  if (digits && text.size() > 9) throw Error("`{}` {} is too large", setting.name, printable(text));
  throw Error("`{}` is {}; it must be {}", setting.name, printable(text), allowed_values(setting));
}

Assignment read_assignment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) throw Error("{}: is not name=value", printable(text));
  const std::string name = text.substr(0, equals);
  const Setting* const setting = find_setting(name);
  if (!setting || setting->access == internal)
    throw Error("{}: there is no such setting; the nearest is {}", printable(text), nearest_setting(name));
  return read_value(*setting, text.substr(equals + 1));
}

void assign(Settings& settings, const Assignment& assignment) {
  with_member(*assignment.setting, [&]<typename T>(T Settings::*member) {
    if constexpr (std::is_same_v<T, bool>)
      settings.*member = std::get<bool>(assignment.value);
    else if constexpr (kIsWhole<T>)
      settings.*member = static_cast<T>(std::get<std::uint64_t>(assignment.value));
    else if constexpr (std::is_same_v<T, Recipe>)
      settings.*member = std::get<std::string>(assignment.value) == "real" ? Recipe::real : Recipe::synthetic;
    else if constexpr (!std::is_same_v<T, std::array<double, 3>>)
      settings.*member = std::get<T>(assignment.value);
  });
}

void set_defaults(Settings& settings, Column column) {
  for (const Setting& setting : kTable)
    if (const auto value = value_in(setting.defaults, column))
      with_member(setting, [&]<typename T>(T Settings::*member) {
        if constexpr (std::is_arithmetic_v<T>) settings.*member = static_cast<T>(*value);
      });
}

}  // namespace trisoup::train
