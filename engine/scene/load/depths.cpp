#include "scene/load/depths.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "scene/datasets/mask_image.h"
#include "scene/lens/undistort.h"
#include "scene/load/depth_agreement.h"
#include "scene/load/depth_fit.h"
#include "scene/text/findings.h"

namespace trisoup::scene {
namespace {

/// Fewest samples that tell the scale of a scene, and scale and shift of one map.
constexpr std::size_t kFewestOfScene = 30, kFewestOfMap = 12;

/// A depth map while it is read.
struct DepthOfView {
  const Shot* shot = nullptr;
  View* view = nullptr;
  ValueMap map;  // of the view's field of view; empty: there is none
  std::string problem;
  std::vector<DepthSample> samples;
  DepthFit fit;

  bool usable() const { return !map.values.empty() && problem.empty(); }
};

bool is_measured(float value) { return value > 0 && std::isfinite(value); }

/// Camera of a view for its depth map.
Camera depth_camera(const Shot& shot, int width, int height) {
  const Camera& view = shot.camera;
  const int longest = std::min({kLongestDepthSide, std::max(view.width, view.height), std::max(width, height)});
  const double scale = double(longest) / std::max(view.width, view.height);
  const auto side = [&](int n) { return std::max(1, static_cast<int>(std::lround(n * scale))); };
  return resized(view, side(view.width), side(view.height));
}

bool are_exact(DepthMaps kind) { return kind == DepthMaps::automatic || kind == DepthMaps::metric; }

/// Reads the file. Throws Error with the problem alone.
void read_map(DepthOfView& depth, const LoadOptions& options) {
  const Frame& frame = depth.shot->frame;
  const std::string name = printable(frame.depth.string());
  if (frame.lens.is_panorama()) throw Error("depth maps of panoramas are not read");
  if (!is_file(frame.depth)) throw Error("the file does not exist; add it");
  ValueMap map = read_values(frame.depth);
  if (map.numbers == ValueMap::Numbers::bits_8 && are_exact(options.depth_maps))
    throw Error(
        "8 bits are too few for depths; write 16 bits, or for the inverse depth of a network use `depth_maps` inverse");
  if (!have_proportions(map.width, map.height, frame.size))
    throw Error("has other proportions than its photograph; write it with the same field of view");
  if (std::none_of(map.values.begin(), map.values.end(), is_measured))
    throw Error("measures nothing (0, negative or not finite everywhere); write it again");
  depth.map = undistort(map, depth.shot->source, frame.lens, depth_camera(*depth.shot, map.width, map.height));
}

void read_maps(std::vector<DepthOfView>& depths, const LoadOptions& options) {
  parallel_for(static_cast<int>(depths.size()), options.threads, [&](int i) {
    DepthOfView& depth = depths[std::size_t(i)];
    const std::string file = printable(depth.shot->frame.depth.string()) + ": ";
    try {
      read_map(depth, options);
    } catch (const Error& error) {
      depth.problem = error.what();
      if (depth.problem.starts_with(file)) depth.problem.erase(0, file.size());
    }
  });
}

/// Adds the sample of a point if the map shows it. Returns whether it did.
bool add_sample(DepthOfView& depth, const glm::vec3& point) {
  const auto shown = shown_at(depth.view->camera, glm::dvec3(point));
  if (!shown) return false;
  const ValueMap& map = depth.map;
  const int x = std::min(map.width - 1, static_cast<int>(shown->pixel.x * map.width / depth.view->camera.width)),
            y = std::min(map.height - 1, static_cast<int>(shown->pixel.y * map.height / depth.view->camera.height));
  const float value = map.values[std::size_t(y) * std::size_t(map.width) + std::size_t(x)];
  if (is_measured(value)) depth.samples.push_back({value, 1 / shown->depth});
  return is_measured(value);
}

/// The sparse points that the maps show. Without observations these may be hidden.
void take_samples(std::vector<DepthOfView>& depths, const Scene& scene) {
  constexpr std::size_t kMost = 1000;  // of each map
  const Points& points = scene.points;
  const std::size_t step = 1 + (points.seen_by.empty() ? points.positions.size() / kMost : 0);
  for (DepthOfView& depth : depths) {
    if (!depth.usable()) continue;
    const auto view = static_cast<std::uint32_t>(depth.view - scene.train.data());
    for (std::size_t p = 0; p < points.positions.size() && depth.samples.size() < kMost; p += step)
      if (points.seen_by.empty() || std::binary_search(points.seen_by[p].begin(), points.seen_by[p].end(), view))
        add_sample(depth, points.positions[p]);
  }
}

/// Share of a map's samples that must agree with its fit.
double least_share(const Scene& scene) { return scene.points.seen_by.empty() ? 0.3 : 0.5; }

bool fits(const DepthOfView& depth, const DepthFit& fit, double least) {
  if (fit.kind == DepthMaps::metric && depth.samples.size() < kFewestOfMap) return true;
  return depth.samples.size() >= kFewestOfMap && fit.scale > 0 && quality_of(fit, depth.samples).share >= least &&
         (fit.kind == DepthMaps::metric || beats_one_depth(fit, depth.samples));
}

std::vector<DepthSample> all_samples(const std::vector<DepthOfView>& depths) {
  std::vector<DepthSample> all;
  for (const DepthOfView& depth : depths) all.insert(all.end(), depth.samples.begin(), depth.samples.end());
  return all;
}

/// Normalised length of a map's unit by its file and the options.
double unit_of(const DepthOfView& depth, const Scene& scene, const LoadOptions& options) {
  const double own = depth.shot->frame.depth_unit, usual = depth.map.numbers == ValueMap::Numbers::real ? 1 : 0.001;
  return scene.normalisation.scale * (options.depth_unit > 0 ? options.depth_unit : own > 0 ? own : usual);
}

/// Sets the fits of one kind. Returns the number of maps that fit.
std::size_t fit_maps(std::vector<DepthOfView>& depths, DepthMaps kind, const Scene& scene, const LoadOptions& options) {
  const std::vector<DepthSample> all = all_samples(depths);
  const bool scaled = kind == DepthMaps::metric && all.size() >= kFewestOfScene;
  const DepthFit of_scene = scaled ? fit_scale(all) : DepthFit{};
  parallel_for(static_cast<int>(depths.size()), options.threads, [&](int i) {
    DepthOfView& depth = depths[std::size_t(i)];
    if (!depth.usable()) return;
    if (kind != DepthMaps::metric)
      depth.fit = fit_scale_and_shift(kind, depth.samples);
    else
      depth.fit = scaled ? of_scene : DepthFit{kind, unit_of(depth, scene, options), 0};
  });
  const bool trusted = !scaled && kind == DepthMaps::metric;
  return static_cast<std::size_t>(std::count_if(depths.begin(), depths.end(), [&](const DepthOfView& depth) {
    return depth.usable() && (trusted || fits(depth, depth.fit, least_share(scene)));
  }));
}

/// Sets the fits of the kind that the options ask for, or that explains most maps. Returns the kind.
DepthMaps choose_fits(std::vector<DepthOfView>& depths, const Scene& scene, const LoadOptions& options) {
  if (options.depth_maps != DepthMaps::automatic) {
    fit_maps(depths, options.depth_maps, scene, options);
    return options.depth_maps;
  }
  const auto usable =
      static_cast<std::size_t>(std::count_if(depths.begin(), depths.end(), [](const auto& d) { return d.usable(); }));
  DepthMaps best = DepthMaps::metric;
  // Metric fits have one number for all maps, so they need no more than half.
  if (std::size_t most = fit_maps(depths, best, scene, options); 2 * most < usable)
    for (const DepthMaps kind : {DepthMaps::inverse, DepthMaps::relative})
      if (const std::size_t fitting = fit_maps(depths, kind, scene, options); fitting > most)
        best = kind, most = fitting;
  fit_maps(depths, best, scene, options);
  return best;
}

/// Marks the maps that contradict the sparse points.
void judge_fits(std::vector<DepthOfView>& depths, DepthMaps kind, const Scene& scene) {
  const bool scaled = all_samples(depths).size() >= kFewestOfScene;
  for (DepthOfView& depth : depths) {
    if (!depth.usable() || (kind == DepthMaps::metric && !scaled)) continue;
    if (kind != DepthMaps::metric && depth.samples.size() < kFewestOfMap)
      depth.problem = fmt::format(
          "fewer than {} sparse points tell its scale and shift; give metric depths or a dataset with more points",
          kFewestOfMap);
    else if (!fits(depth, depth.fit, least_share(scene)))
      depth.problem = "contradicts the sparse points; check that it belongs to the photograph, and `depth_maps`";
  }
}

MeasuredDepth measured(const DepthOfView& depth) {
  MeasuredDepth result{depth.map.width, depth.map.height, {}};
  result.inverse.reserve(depth.map.values.size());
  for (const float value : depth.map.values)
    result.inverse.push_back(is_measured(value) ? static_cast<float>(depth.fit.inverse_of(value)) : 0.0f);
  return result;
}

std::string summary_of_depths(const std::vector<DepthOfView>& depths, DepthMaps kind, std::size_t training_views) {
  std::size_t used = 0, samples = 0;
  std::vector<double> errors;
  for (const DepthOfView& depth : depths) {
    if (!depth.usable()) continue;
    ++used, samples += depth.samples.size();
    if (!depth.samples.empty()) errors.push_back(quality_of(depth.fit, depth.samples).error);
  }
  std::string text = fmt::format("depth maps for {} of {} training views, {}", used, training_views,
                                 kind == DepthMaps::metric     ? "metric"
                                 : kind == DepthMaps::relative ? "relative"
                                                               : "relative, inverse");
  if (used == 0) return text;
  if (samples < kFewestOfScene) return text + " without points";
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2), errors.end());
  return text + fmt::format(", fitted to {} points (median error {:.2g} %)", samples, 100 * errors[errors.size() / 2]);
}

/// Depths whose unit nothing tells may not have that of the poses, whose scale COLMAP chooses: then the one with which
/// the maps agree is used.
void mend_unit(Scene& scene, const std::vector<DepthOfView>& depths, const LoadOptions& options) {
  const auto is_told = [](const DepthOfView& depth) { return depth.shot->frame.depth_unit > 0; };
  if (options.depth_unit > 0 || std::any_of(depths.begin(), depths.end(), is_told)) return;
  const DepthAgreement agreement = agreement_of_depths(scene.train);
  if (!agreement.contradicts_unit()) return;
  for (View& view : scene.train)
    for (float& inverse : view.depth.inverse) inverse /= static_cast<float>(agreement.times);
  if (options.warn)
    options.warn(fmt::format(
        "{}: depth maps agree with each other in {:.0f} % of their pixels, but in {:.0f} % if multiplied by {:.3g}, "
        "which is done; if that is wrong, give `depth_unit`",
        depths.front().shot->frame.source, 100 * agreement.as_given, 100 * agreement.best, agreement.times));
}

}  // namespace

std::uint64_t depth_bytes(const std::vector<const Shot*>& shots, const LoadOptions& options) {
  std::uint64_t bytes = 0;
  for (const Shot* shot : shots) {
    if (options.depth_maps == DepthMaps::none || shot->frame.depth.empty() || shot->frame.test) continue;
    const Camera camera = depth_camera(*shot, kLongestDepthSide, kLongestDepthSide);
    bytes += 4ull * static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
  }
  return bytes;
}

void read_depths(Scene& scene, const std::vector<const Shot*>& shots, const LoadOptions& options) {
  std::vector<DepthOfView> depths;
  for (std::size_t i = 0; i < shots.size(); ++i)
    if (!shots[i]->frame.depth.empty()) depths.push_back({shots[i], &scene.train[i], {}, {}, {}, {}});
  if (depths.empty()) return;
  read_maps(depths, options);
  take_samples(depths, scene);
  const DepthMaps kind = choose_fits(depths, scene, options);
  judge_fits(depths, kind, scene);
  Findings findings;
  for (const DepthOfView& depth : depths) {
    if (depth.usable())
      depth.view->depth = measured(depth);
    else
      findings.leave_out(depth.shot->frame.source, "depth maps", depth.problem,
                         depth.shot->frame.depth.filename().string());
  }
  if (options.warn)
    for (const std::string& line : findings.lines()) options.warn(line);
  if (kind == DepthMaps::metric && all_samples(depths).size() < kFewestOfScene) mend_unit(scene, depths, options);
  scene.summary += "; " + summary_of_depths(depths, kind, scene.train.size());
}

}  // namespace trisoup::scene
