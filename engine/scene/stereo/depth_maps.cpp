#include "scene/stereo/depth_maps.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "args/patch_match.h"
#include "base/parallel_for.h"
#include "scene/lens/area_resample.h"
#include "scene/stereo/neighbours.h"
#include "scene/stereo/support.h"

namespace trisoup::scene {
namespace {

constexpr std::uint32_t kSeed = 0x7ee1;
constexpr double kLeastRange = 8;  // largest inverse depth of a view without probes

/// The pictures of one level, one after the other.
struct PyramidLevel {
  std::vector<Camera> cameras;
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint32_t> greys;  // PatchMatchArgs::greys
};

/// What stays the same for a view on all levels.
struct Plan {
  std::vector<std::uint32_t> neighbours;
  double nearest = kLeastRange;
};

/// Grey of the photograph at the camera's size, 1 to 255; 0 at masked pixels.
std::vector<std::uint8_t> small_grey(const Image& image, const Camera& camera) {
  const Photograph small = area_resample(from_mask(image), camera.width, camera.height);
  std::vector<std::uint8_t> grey;
  for (std::size_t i = 0; i < small.pixels(); ++i) {
    const float mean = glm::dot(glm::vec3(small.colour[i]), glm::vec3(0.299f, 0.587f, 0.114f));
    const bool masked = !small.inside.empty() && small.inside[i] == 0;
    grey.push_back(masked ? 0 : static_cast<std::uint8_t>(std::clamp(mean + 0.5f, 1.0f, 255.0f)));
  }
  return grey;
}

/// Every pixel with its neighbours to the right and below, so that a kernel reads once between four pixels.
void add_picture(const Image& image, PyramidLevel& level, std::size_t view) {
  const int width = level.cameras[view].width, height = level.cameras[view].height;
  const std::vector<std::uint8_t> grey = small_grey(image, level.cameras[view]);
  const auto at = [&](int x, int y) {
    return static_cast<std::uint32_t>(
        grey[static_cast<std::size_t>(std::min(y, height - 1) * width + std::min(x, width - 1))]);
  };
  std::uint32_t* out = &level.greys[level.offsets[view]];
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) *out++ = at(x, y) | at(x + 1, y) << 8 | at(x, y + 1) << 16 | at(x + 1, y + 1) << 24;
}

/// Views that are not `chosen` have no pixels.
PyramidLevel level_of(std::span<const View> views, std::span<const std::uint32_t> chosen, int longer_side) {
  PyramidLevel level;
  level.cameras.resize(views.size());
  level.offsets.resize(views.size());
  std::uint32_t pixels = 0;
  for (const std::uint32_t v : chosen) {
    const Image& image = views[v].image;
    const double scale = std::min(1.0, longer_side / static_cast<double>(std::max({1, image.width, image.height})));
    const int width = std::max(1, static_cast<int>(std::lround(scale * image.width))),
              height = std::max(1, static_cast<int>(std::lround(scale * image.height)));
    level.cameras[v] = resized(views[v].camera, width, height);
    level.offsets[v] = pixels;
    pixels += static_cast<std::uint32_t>(width * height);
  }
  level.greys.resize(pixels);
  parallel_for(static_cast<int>(chosen.size()), 0, [&](int i) {
    const std::uint32_t v = chosen[static_cast<std::size_t>(i)];
    add_picture(views[v].image, level, v);
  });
  return level;
}

/// The longer side of small pictures of about `pixels` pixels each.
int longer_side(std::span<const View> views, std::span<const std::uint32_t> chosen, const DepthMapOptions& options) {
  double aspect = 0;  // mean of the shorter side as a share of the longer one
  for (const std::uint32_t v : chosen) {
    const Image& image = views[v].image;
    aspect += static_cast<double>(std::min(image.width, image.height)) / std::max(image.width, image.height);
  }
  const double side = std::sqrt(static_cast<double>(options.pixels) / std::max(aspect, 1e-3));
  return std::clamp(static_cast<int>(side), options.shortest_long_side, options.longest_side);
}

/// Rows of the map from (x, y, 1, inverse depth) in `from` to homogeneous pixels in `to`; pixel centres are integers.
std::array<glm::vec4, 3> transfer(const Camera& from, const Camera& to) {
  const glm::dmat4 motion = to.world_to_camera * glm::inverse(from.world_to_camera);
  const glm::dmat3 project = glm::transpose(
      glm::dmat3(glm::dvec3(to.fx, 0, to.cx - 0.5), glm::dvec3(0, to.fy, to.cy - 0.5), glm::dvec3(0, 0, 1)));
  const glm::dmat3 unproject = glm::inverse(glm::transpose(
      glm::dmat3(glm::dvec3(from.fx, 0, from.cx - 0.5), glm::dvec3(0, from.fy, from.cy - 0.5), glm::dvec3(0, 0, 1))));
  const glm::dmat3 m = project * glm::dmat3(motion) * unproject;
  const glm::dvec3 s = project * glm::dvec3(motion[3]);
  std::array<glm::vec4, 3> rows;
  for (int r = 0; r < 3; ++r) rows[static_cast<std::size_t>(r)] = glm::vec4(m[0][r], m[1][r], m[2][r], s[r]);
  return rows;
}

std::vector<kernels::StereoPair> pairs_of(const PyramidLevel& level, std::span<const Plan> plans) {
  std::vector<kernels::StereoPair> pairs;
  for (std::size_t v = 0; v < plans.size(); ++v)
    for (const std::uint32_t n : plans[v].neighbours) {
      const auto to = transfer(level.cameras[v], level.cameras[n]), from = transfer(level.cameras[n], level.cameras[v]);
      pairs.push_back({to[0], to[1], to[2], from[0], from[1], from[2],
                       static_cast<std::uint32_t>(level.cameras[n].width),
                       static_cast<std::uint32_t>(level.cameras[n].height), level.offsets[n], 0});
    }
  return pairs;
}

/// Change of inverse depth that moves a point by about a pixel in the neighbour with the widest baseline.
double pixel_step(const PyramidLevel& level, const Plan& plan, std::size_t view) {
  double farthest = 0;
  for (const std::uint32_t n : plan.neighbours) {
    const Camera& other = level.cameras[n];
    farthest =
        std::max(farthest, std::max(other.fx, other.fy) * glm::distance(other.centre(), level.cameras[view].centre()));
  }
  return farthest > 0 ? 1.0 / farthest : 0.0;
}

/// Twice the inverse depth of the nearest hundredth of a view's probes.
double nearest_of(const Camera& camera, const Probes& probes) {
  std::vector<double> inverse;
  for (const glm::dvec3& place : probes) {
    const double z = (camera.world_to_camera * glm::dvec4(place, 1.0)).z;
    if (z > 1e-6) inverse.push_back(1.0 / z);
  }
  if (inverse.empty()) return kLeastRange;
  const auto at = static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(inverse.size() - 1));
  std::nth_element(inverse.begin(), inverse.begin() + at, inverse.end());
  return 2.0 * inverse[static_cast<std::size_t>(at)];
}

/// The buffers of one level, and the launches on them.
class Matcher {
 public:
  Matcher(gpu::Device& gpu, const PyramidLevel& level, std::span<const Plan> plans)
      : gpu_(gpu), level_(level), plans_(plans) {
    const std::vector<kernels::StereoPair> pairs = pairs_of(level, plans);
    greys_ = gpu.allocate(4 * level.greys.size(), "pictures of stereo");
    planes_ = gpu.allocate(16 * level.greys.size(), "planes of stereo");
    before_ = gpu.allocate(16 * level.greys.size(), "planes of stereo");
    agreeing_ = gpu.allocate(4 * level.greys.size(), "agreement of stereo");
    pairs_ = gpu.allocate(std::max<std::size_t>(1, pairs.size()) * sizeof(kernels::StereoPair), "pairs of stereo");
    gpu.upload(greys_.address(), level.greys);
    gpu.upload(pairs_.address(), pairs);
  }

  void start(const Matcher* coarse) {
    for_each_view([&](std::size_t v, kernels::PatchMatchArgs& a) {
      if (coarse) {
        const Camera& camera = coarse->level_.cameras[v];
        a.before = coarse->planes_.address();
        a.coarse_width = static_cast<std::uint32_t>(camera.width);
        a.coarse_height = static_cast<std::uint32_t>(camera.height);
        a.coarse_offset = coarse->level_.offsets[v];
      }
      gpu_.launch({"patch_match_start"}, (pixels_of(v) + 63) / 64, a);
    });
    gpu_.cut();
  }

  /// change: largest random change, pixels. geometric: cost per pixel of disagreement with the neighbours' planes.
  void iterate(double change, double geometric, bool all_neighbours) {
    ++iteration_;
    if (geometric > 0) gpu_.copy(before_.address(), planes_.address(), planes_.bytes());
    for_each_view([&](std::size_t, kernels::PatchMatchArgs& a) {
      a.change = static_cast<float>(change);
      a.geometric = static_cast<float>(geometric);
      a.all_neighbours = all_neighbours;
      const std::uint32_t half = (a.width + 1) / 2 * a.height;
      for (a.colour = 0; a.colour < 2; ++a.colour) gpu_.launch({"patch_match"}, (half + 63) / 64, a);
      gpu_.cut();
    });
    gpu_.wait();
  }

  /// Planes and agreement of all pixels.
  void finish(std::vector<DepthMap>& maps) {
    gpu_.copy(before_.address(), planes_.address(), planes_.bytes());
    for_each_view([&](std::size_t v, kernels::PatchMatchArgs& a) {
      a.largest_cost = kLargestPlaneCost;
      gpu_.launch({"patch_match_agree"}, (pixels_of(v) + 63) / 64, a);
      gpu_.cut();
    });
    for (std::size_t v = 0; v < plans_.size(); ++v) {
      DepthMap& map = maps[v];
      map.camera = level_.cameras[v];
      map.neighbours = plans_[v].neighbours;
      map.pixel_step = pixel_step(level_, plans_[v], v);
      if (map.neighbours.empty()) continue;
      map.planes = gpu_.download_vector<glm::vec4>(planes_.address() + 16ull * level_.offsets[v], pixels_of(v));
      map.agreeing = gpu_.download_vector<std::uint32_t>(agreeing_.address() + 4ull * level_.offsets[v], pixels_of(v));
    }
  }

 private:
  std::size_t pixels_of(std::size_t v) const {
    return static_cast<std::size_t>(level_.cameras[v].width) * static_cast<std::size_t>(level_.cameras[v].height);
  }

  /// Calls launch(view, arguments) for each view with neighbours.
  template <class Launch>
  void for_each_view(Launch&& launch) {
    std::uint32_t first = 0;
    for (std::size_t v = 0; v < plans_.size(); ++v) {
      if (plans_[v].neighbours.empty()) continue;
      kernels::PatchMatchArgs a{};
      a.greys = greys_.address(), a.planes = planes_.address(), a.before = before_.address();
      a.pairs = pairs_.address(), a.agreeing = agreeing_.address();
      a.first_pair = first, a.pair_count = static_cast<std::uint32_t>(plans_[v].neighbours.size());
      a.width = static_cast<std::uint32_t>(level_.cameras[v].width);
      a.height = static_cast<std::uint32_t>(level_.cameras[v].height);
      a.pixel_offset = level_.offsets[v];
      a.key = kSeed + 0x9e37u * static_cast<std::uint32_t>(v) + 0x85ebu * iteration_;
      a.nearest = static_cast<float>(plans_[v].nearest);
      a.pixel_step = static_cast<float>(pixel_step(level_, plans_[v], v));
      first += a.pair_count;
      launch(v, a);
    }
  }

  gpu::Device& gpu_;
  const PyramidLevel& level_;
  std::span<const Plan> plans_;
  gpu::Buffer greys_, planes_, before_, agreeing_, pairs_;
  std::uint32_t iteration_ = 0;
};

}  // namespace

DepthMap merged(DepthMap finer, const DepthMap& coarser) {
  if (finer.planes.empty() || coarser.planes.empty()) return finer;
  const double scale_x = static_cast<double>(coarser.camera.width) / finer.camera.width,
               scale_y = static_cast<double>(coarser.camera.height) / finer.camera.height;
  std::size_t pixel = 0;
  for (int y = 0; y < finer.camera.height; ++y)
    for (int x = 0; x < finer.camera.width; ++x, ++pixel) {
      const double u = (x + 0.5) * scale_x, v = (y + 0.5) * scale_y;
      const int i = std::min(static_cast<int>(u), coarser.camera.width - 1),
                j = std::min(static_cast<int>(v), coarser.camera.height - 1);
      const auto from =
          static_cast<std::size_t>(j) * static_cast<std::size_t>(coarser.camera.width) + static_cast<std::size_t>(i);
      if (std::popcount(finer.agreeing[pixel]) >= 2 || std::popcount(coarser.agreeing[from]) < 2) continue;
      const glm::vec4 plane = coarser.planes[from];
      const double w = plane.x + plane.y * (u - 0.5 - i) + plane.z * (v - 0.5 - j);
      finer.planes[pixel] = glm::vec4(w, plane.y * scale_x, plane.z * scale_y, plane.w);
      finer.agreeing[pixel] = coarser.agreeing[from];
    }
  return finer;
}

std::vector<DepthMap> depth_maps(gpu::Device& gpu, std::span<const View> views, const Points& points,
                                 const DepthMapOptions& options) {
  std::vector<DepthMap> maps(views.size());
  constexpr double kAspect = 0.7;
  const auto smallest = kAspect * options.shortest_long_side * options.shortest_long_side;
  const std::vector<std::uint32_t> chosen =
      spread_views(views, static_cast<std::size_t>(static_cast<double>(options.pixels) / smallest));
  const std::vector<Probes> probes = probes_of(views, points);
  const auto neighbours = stereo_neighbours(views, probes, chosen, options.neighbours);
  const int side = longer_side(views, chosen, options);
  std::vector<Plan> plans(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) plans[v] = {neighbours[v], nearest_of(views[v].camera, probes[v])};
  std::vector<PyramidLevel> levels;
  for (const int share : {4, 2, 1}) levels.push_back(level_of(views, chosen, std::max(1, side / share)));
  if (levels.back().greys.empty() || pairs_of(levels.back(), plans).empty()) return maps;
  constexpr double kSearch[] = {16, 8, 4, 2, 1, 0.5}, kRefine[] = {1, 0.5}, kGeometric[] = {0.5, 0.25};
  constexpr double kCostPerPixel = 0.1;
  constexpr int kWork[] = {2, 8, 16}, kTotal = 26;  // twice the size has four times the pixels, but fewer iterations
  int done = 0;
  if (options.progress) options.progress(done, kTotal);
  std::unique_ptr<Matcher> coarser;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    auto matcher = std::make_unique<Matcher>(gpu, levels[l], plans);
    matcher->start(coarser.get());
    if (l + 1 < levels.size())
      for (const double change : kSearch) matcher->iterate(change, 0, change > 2);
    else
      for (const double change : kRefine) matcher->iterate(change, 0, false);
    for (const double change : kGeometric) matcher->iterate(change, kCostPerPixel, false);
    // The first level only guides the second: its patches reach so far across edges that its own planes are too wide.
    if (l > 0) {
      std::vector<DepthMap> finer(views.size());
      matcher->finish(finer);
      for (std::size_t v = 0; v < maps.size(); ++v) maps[v] = merged(std::move(finer[v]), maps[v]);
    }
    coarser = std::move(matcher);
    done += kWork[l];
    if (options.progress) options.progress(done, kTotal);
  }
  parallel_for(static_cast<int>(maps.size()), 0, [&](int v) { drop_unsupported(maps[static_cast<std::size_t>(v)]); });
  return maps;
}

}  // namespace trisoup::scene
