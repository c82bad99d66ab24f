#include "train/quality/camera_exposures.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/printable.h"

namespace trisoup::train {
namespace {

std::string folder_of(const std::string& name) {
  const std::size_t slash = name.find_last_of('/');
  return slash == std::string::npos ? std::string() : name.substr(0, slash);
}

/// The camera of a view without its exposure.
soup::CameraExposure camera_of(const scene::View& view) {
  const double longer = std::max(view.camera.width, view.camera.height),
               shorter = std::min(view.camera.width, view.camera.height);
  soup::CameraExposure camera;
  camera.folder = folder_of(utf8(view.name));
  camera.focal = std::sqrt(view.camera.fx * view.camera.fy) / longer;
  camera.aspect = longer / shorter;
  return camera;
}

bool is_same(const soup::CameraExposure& a, const soup::CameraExposure& b) {
  constexpr double kFocal = 1.1, kAspect = 1.02;  // ratios that focusing and rounded sizes stay below
  const auto near = [](double x, double y, double ratio) { return x < ratio * y && y < ratio * x; };
  return a.folder == b.folder && near(a.focal, b.focal, kFocal) && near(a.aspect, b.aspect, kAspect);
}

/// Exposures of the photographs of one camera.
struct Group {
  double count = 0;
  glm::dvec3 gain{0.0}, offset{0.0}, squares{0.0};  // sums; squares: of gains minus 1
  glm::dvec3 mean_gain() const { return gain / count; }
  double spread() const {  // sum of squared distances from the mean gain, mean over the channels
    const glm::dvec3 beyond = mean_gain() - 1.0, sum = squares - count * beyond * beyond;
    return std::max(0.0, (sum.x + sum.y + sum.z) / 3);
  }
};

}  // namespace

std::vector<soup::CameraExposure> camera_exposures(const std::vector<scene::View>& views,
                                                   std::span<const glm::vec4> exposures) {
  std::vector<soup::CameraExposure> cameras;
  std::vector<Group> groups;
  if (exposures.empty()) return cameras;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const soup::CameraExposure camera = camera_of(views[v]);
    const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return is_same(c, camera); });
    const auto at = static_cast<std::size_t>(found - cameras.begin());
    if (found == cameras.end()) cameras.push_back(camera), groups.emplace_back();
    const glm::dvec3 gain(exposures[2 * v]), offset(exposures[2 * v + 1]);
    groups[at].count += 1;
    groups[at].gain += gain;
    groups[at].offset += offset;
    groups[at].squares += (gain - 1.0) * (gain - 1.0);
  }
  if (cameras.size() < 2) return {};
  double within = 0;
  for (const Group& g : groups) within += g.spread();
  // Every camera's mean takes a degree of freedom.
  within /= std::max(1.0, double(views.size() - groups.size()));
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const glm::dvec3 gain = groups[i].mean_gain(), beyond = gain - 1.0;
    const double between = glm::dot(beyond, beyond) / 3, noise = within / groups[i].count;
    const double share = between > noise ? 1 - noise / between : 0;  // James and Stein 1961, as of photographs
    cameras[i].gain = glm::vec3(1.0 + share * beyond);
    cameras[i].offset = glm::vec3(share * groups[i].offset / groups[i].count);
  }
  return cameras;
}

void expose(std::vector<float>& colour, const soup::CameraExposure& e, const glm::vec3& background) {
  for (std::size_t i = 0; i + 2 < colour.size(); i += 3) {
    const glm::vec3 c(colour[i], colour[i + 1], colour[i + 2]);
    if (c == background) continue;
    for (int k = 0; k < 3; ++k)
      colour[i + static_cast<std::size_t>(k)] = std::clamp(e.gain[k] * c[k] + e.offset[k], 0.0f, 1.0f);
  }
}

const soup::CameraExposure* exposure_of(const scene::View& view, std::span<const soup::CameraExposure> cameras) {
  const soup::CameraExposure camera = camera_of(view);
  for (const soup::CameraExposure& c : cameras)
    if (is_same(c, camera)) return &c;
  return nullptr;
}

}  // namespace trisoup::train
