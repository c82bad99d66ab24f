#include "scene/load/from_memory.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "scene/fingerprint.h"
#include "scene/lens/photograph.h"
#include "scene/load/consistency.h"
#include "scene/up_direction.h"

namespace trisoup::scene {
namespace {

constexpr const char* kSource = "photographs";  // begins messages about all of them

bool is_pose(const glm::dmat4& m) {
  const glm::dmat3 r(m);
  const glm::dmat3 square = glm::transpose(r) * r;
  double error = 0;
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row)
      if (!std::isfinite(m[column][row])) return false;
    error = std::max(error, std::abs(m[column][3] - (column == 3 ? 1.0 : 0.0)));
  }
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) error = std::max(error, std::abs(square[column][row] - (row == column ? 1 : 0)));
  return error < 1e-3 && glm::determinant(r) > 0;
}

void check_photograph(const MemoryPhotograph& photograph) {
  const Camera& c = photograph.camera;
  const std::string name = printable(photograph.name);
  const std::size_t pixels = std::size_t(std::max(c.width, 0)) * std::size_t(std::max(c.height, 0));
  constexpr int kLongest = 1 << 16;
  if (c.width < 1 || c.height < 1 || c.width > kLongest || c.height > kLongest)
    throw Error("{}: its camera has {} x {} pixels; give sides from 1 to {}", name, c.width, c.height, kLongest);
  if (photograph.image.width != c.width || photograph.image.height != c.height ||
      photograph.image.rgba.size() != 4 * pixels)
    throw Error("{}: is {} x {} pixels but its camera has {} x {}; resize one of them", name, photograph.image.width,
                photograph.image.height, c.width, c.height);
  if (!photograph.mask.empty() && photograph.mask.size() != pixels)
    throw Error("{}: its mask has {} values for {} x {} pixels; give one for each", name, photograph.mask.size(),
                c.width, c.height);
  const double most = 50.0 * std::max(c.width, c.height);
  if (!(c.fx > 0 && c.fy > 0 && c.fx < most && c.fy < most && c.fx < 1e6 && c.fy < 1e6))
    throw Error("{}: its focal lengths are {} and {}; give pixels, above 0 and at most 50 image sides", name, c.fx,
                c.fy);
  if (!(c.cx >= 0 && c.cy >= 0 && c.cx <= c.width && c.cy <= c.height))
    throw Error("{}: its principal point ({}, {}) is outside of the image; give pixels", name, c.cx, c.cy);
  if (!is_pose(c.world_to_camera))
    throw Error("{}: its world_to_camera is not a rotation and a translation; give a rigid 4 x 4 matrix", name);
}

void check_names(const std::vector<MemoryPhotograph>& photographs) {
  std::set<std::string> names;
  for (const MemoryPhotograph& photograph : photographs) {
    if (photograph.name.empty()) throw Error("{}: one has no name; give each a name of its own", kSource);
    if (!names.insert(photograph.name).second)
      throw Error("{}: two have the name {}; give each a name of its own", kSource, printable(photograph.name));
  }
}

void split(std::vector<MemoryPhotograph>& photographs, int test_every) {
  if (test_every < 0 || test_every == 1)
    throw Error("`test_every` {}: must be 0 for no test views, or at least 2", test_every);
  const bool chosen = std::any_of(photographs.begin(), photographs.end(), [](const auto& p) { return p.test; });
  if (chosen || test_every == 0 || photographs.size() < 2) return;
  for (std::size_t i = 0; i < photographs.size(); i += std::size_t(test_every)) photographs[i].test = true;
}

/// Converts a photograph as load() does, its mask included. found: what its alpha channel holds.
Photograph developed(const MemoryPhotograph& photograph, const LoadOptions& options, AlphaFound found) {
  const bool covers = options.alpha == AlphaUse::composite && found != AlphaFound::empty;
  Photograph result = covers ? from_coverage(photograph.image) : from_mask(photograph.image);
  if (!covers && options.alpha == AlphaUse::composite) result.inside.clear();
  if (photograph.mask.empty()) return result;
  if (result.inside.empty()) result.inside.assign(result.pixels(), 255);
  for (std::size_t i = 0; i < result.pixels(); ++i)
    if ((photograph.mask[i] != 0) == options.invert_masks) result.inside[i] = 0;
  return result;
}

/// Composites all photographs on the same background, as decode() does. Returns its grey level.
std::uint8_t composite_all(std::vector<MemoryPhotograph>& photographs, const LoadOptions& options,
                           std::size_t& with_alpha) {
  std::vector<AlphaFound> found;
  for (const MemoryPhotograph& photograph : photographs) found.push_back(alpha_of(photograph.image));
  with_alpha = std::size_t(std::count(found.begin(), found.end(), AlphaFound::some));
  const std::uint8_t background = grey_level(options.background, with_alpha > 0);
  for (std::size_t i = 0; i < photographs.size(); ++i)
    photographs[i].image = composite(developed(photographs[i], options, found[i]), background);
  return background;
}

Points normalised_points(const PointCloud& cloud, const Normalisation& normalisation) {
  if (!cloud.colours.empty() && cloud.colours.size() != cloud.positions.size())
    throw Error("points: {} positions and {} colours; give one colour for each", cloud.positions.size(),
                cloud.colours.size());
  Points points;
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
    const glm::dvec3 p = normalisation.to_normalised(cloud.positions[i]);
    if (!(glm::length(p) < 1e18)) throw Error("points: number {} is not finite; remove it", i);
    points.positions.emplace_back(p);
    if (!cloud.colours.empty()) points.colours.push_back(cloud.colours[i]);
  }
  return points;
}

std::uint64_t fingerprint_of(const std::vector<MemoryPhotograph>& photographs) {
  Fingerprint result;
  for (const MemoryPhotograph& photograph : photographs) {
    const Camera& c = photograph.camera;
    result.add(photograph.name);
    result.add(photograph.test ? 1 : 0);
    result.add(c.width), result.add(c.height);
    for (const double value : {c.fx, c.fy, c.cx, c.cy}) result.add(value);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) result.add(c.world_to_camera[column][row]);
  }
  return result.value();
}

/// As load() decides it: renders of an object before nothing.
bool is_object(std::span<const Camera> cameras, const PointCloud& points, std::size_t with_alpha,
               const LoadOptions& options) {
  constexpr double kMaxSine = 0.3;
  if (options.alpha != AlphaUse::composite || !points.positions.empty()) return false;
  if (meeting_point(cameras) && !look_inwards(cameras, kMaxSine)) return false;
  return 2 * with_alpha > cameras.size();
}

}  // namespace

Scene scene_from_memory(std::vector<MemoryPhotograph> photographs, const PointCloud& points,
                        const LoadOptions& options) {
  if (photographs.empty()) throw Error("{}: there are none; give at least one", kSource);
  check_names(photographs);
  for (const MemoryPhotograph& photograph : photographs) check_photograph(photograph);
  std::stable_sort(photographs.begin(), photographs.end(),
                   [](const auto& a, const auto& b) { return a.name < b.name; });
  split(photographs, options.test_every);
  std::vector<Camera> all, train;
  for (const MemoryPhotograph& photograph : photographs) {
    all.push_back(photograph.camera);
    if (!photograph.test) train.push_back(photograph.camera);
  }
  if (train.empty()) throw Error("{}: all are test views; mark fewer of them", kSource);

  Scene scene;
  scene.format = Format::transforms;
  scene.path = kSource;
  scene.summary = fmt::format("{} photographs in memory", photographs.size());
  std::size_t with_alpha = 0;
  scene.background = glm::vec3(composite_all(photographs, options, with_alpha) / 255.0f);
  scene.synthetic = is_object(all, points, with_alpha, options);
  scene.fingerprint = fingerprint_of(photographs);
  scene.normalisation = find_normalisation(train, points, kSource);
  scene.points = normalised_points(points, scene.normalisation);
  for (Camera& camera : all) camera = normalised(camera, scene.normalisation);
  if (const UpDirection up = up_direction(all, {}, scene.points.positions); !up.reason.empty()) scene.up = up.direction;
  bool any_pixels = false;
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    std::vector<View>& views = photographs[i].test ? scene.test : scene.train;
    views.push_back({photographs[i].name, all[i], std::move(photographs[i].image)});
    any_pixels = any_pixels || (!photographs[i].test && has_pixels(views.back().image));
  }
  if (!any_pixels) throw Error("{}: masks exclude every pixel of the training views; invert them", kSource);
  return scene;
}

}  // namespace trisoup::scene
