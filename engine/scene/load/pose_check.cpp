#include "scene/load/pose_check.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/error.h"
#include "scene/normalisation.h"
#include "scene/points_from_views.h"

namespace trisoup::scene {
namespace {

constexpr std::array kOthers{PoseReading::other_axes, PoseReading::inverse, PoseReading::inverse_other_axes};
/// Cameras that look at one place with so little error are read rightly: 6 degrees. Wrong readings have more.
constexpr double kCertainSine = 0.1;
constexpr std::size_t kProbesForColours = 12, kProbesForSweeps = 30;
constexpr int kSideForColours = 480, kSideForSweeps = 120;  // pixels; sweeps over larger pictures take minutes

std::vector<Camera> reread_all(std::span<const Camera> cameras, PoseReading reading, bool opengl) {
  std::vector<Camera> result(cameras.begin(), cameras.end());
  for (Camera& camera : result) camera.world_to_camera = reread(camera.world_to_camera, reading, opengl);
  return result;
}

/// Points per photograph that sweeps find in the probes.
double found_per_view(std::span<const Camera> cameras, std::span<const Probe> probes) {
  try {
    const Normalisation normalisation = find_normalisation(cameras, {}, {});
    std::vector<View> views;
    for (const Probe& probe : probes) {
      const Camera camera = resized(cameras[probe.view], probe.image.width, probe.image.height);
      views.push_back({{}, normalised(camera, normalisation), probe.image});
    }
    return double(points_from_views(views).positions.size()) / double(std::max<std::size_t>(1, views.size()));
  } catch (const Error&) {  // all cameras at one spot
    return 0;
  }
}

std::string describe(const PointFit& fit) {
  std::string text = fmt::format("{:.0f} % project into photographs", 100 * fit.inside);
  if (fit.colour) text += fmt::format(", colours differ by {:.0f} % of chance", 100 * *fit.colour);
  return text;
}

std::string reread_as(const std::string& source, PoseReading reading, bool opengl, const std::string& why) {
  return fmt::format("{}: the photographs contradict its poses but fit {} ({}), so they are read as such; export {}",
                     source, to_string(reading, opengl), why, to_string(PoseReading::as_written, opengl));
}

/// The reading that explains points beyond doubt, if there is one.
std::optional<PoseReading> reading_by_points(std::span<const Camera> cameras, const PointCloud& points, bool opengl,
                                             std::span<const Probe> probes) {
  std::optional<PoseReading> best;
  double lowest = 1;
  for (const PoseReading reading : kOthers) {
    const PointFit fit = fit_of_points(reread_all(cameras, reading, opengl), points, probes);
    if (fit.is_certain() && *fit.colour < lowest) best = reading, lowest = *fit.colour;
  }
  return best;
}

}  // namespace

PoseCheck check_poses(std::span<const Camera> cameras, const PointCloud& points, PoseConvention written,
                      const std::string& source, const TakeProbes& take_probes) {
  const bool opengl = written == PoseConvention::opengl_to_world, rereads = written != PoseConvention::unmistakable;
  PoseCheck check;
  std::string unfit;
  if (!points.positions.empty()) {
    const std::vector<Probe> probes =
        points.colours.empty() ? std::vector<Probe>{} : take_probes(kProbesForColours, kSideForColours);
    const PointFit fit = fit_of_points(cameras, points, probes);
    if (fit.holds()) return check;
    if (const auto reading = rereads ? reading_by_points(cameras, points, opengl, probes) : std::nullopt)
      return {*reading, true, reread_as(source, *reading, opengl, "by the sparse points")};
    unfit = describe(fit);
  }
  if (points.positions.empty() && (!rereads || look_inwards(cameras, kCertainSine))) return check;

  constexpr double kEnough = 7, kTimes = 4;  // points per photograph; up to 6 are found where poses are wrong
  const std::vector<Probe> probes = take_probes(kProbesForSweeps, kSideForSweeps);
  const double found = found_per_view(cameras, probes);
  if (rereads && found < kEnough)
    for (const PoseReading reading : kOthers) {
      const std::vector<Camera> reread_cameras = reread_all(cameras, reading, opengl);
      const double other = found_per_view(reread_cameras, probes);
      if (other < kEnough || other < kTimes * found) continue;
      if (!points.positions.empty() && !fit_of_points(reread_cameras, points, probes).holds()) continue;
      check.reading = reading;
      check.warning = reread_as(source, reading, opengl, "by points found in them");
      return check;
    }
  if (unfit.empty()) return check;
  check.points_fit = false;
  constexpr double kNothing = 1;
  check.warning = fmt::format(
      "{}: the sparse points do not fit the cameras ({}); they are not used{}; export points and poses from the same "
      "reconstruction, in the same coordinates",
      source, unfit, found < kNothing ? ", and the photographs do not confirm the poses either" : "");
  return check;
}

}  // namespace trisoup::scene
