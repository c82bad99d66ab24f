#include "train/start/surface_start.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "base/error.h"
#include "base/parallel_for.h"
#include "base/sphere_lattice.h"
#include "mesh/decimate_views.h"
#include "mesh/surface.h"
#include "train/start/start_points.h"
#include "train/start/surface_budget.h"

namespace trisoup::train {
namespace {

/// More points would add no detail that a few thousand triangles can keep, and the graph cut would take minutes.
constexpr std::size_t kMostPoints = 40'000;
/// Points on the sphere that closes the surface, and its radius as a share of the backdrop's.
constexpr int kShellPoints = 200;
constexpr double kShellRadius = 0.7;

/// Sets `colour` to the mean of the photographs' colours at `p` over those of `views` whose image contains it. Returns
/// false, and leaves `colour` alone, if there is none.
bool add_colours(const scene::Scene& scene, std::span<const std::uint32_t> views, const glm::dvec3& p,
                 glm::dvec3& colour) {
  glm::dvec3 sum(0.0);
  int count = 0;
  for (const std::uint32_t v : views) {
    const Image& image = scene.train[v].image;
    const auto shown = scene::shown_at(scene.train[v].camera, p);
    if (!shown || image.rgba.empty()) continue;
    const auto x = static_cast<std::size_t>(shown->pixel.x), y = static_cast<std::size_t>(shown->pixel.y);
    const std::uint8_t* pixel = &image.rgba[4 * (y * static_cast<std::size_t>(image.width) + x)];
    if (pixel[3] < 128) continue;
    sum += glm::dvec3(pixel[0], pixel[1], pixel[2]) / 255.0;
    ++count;
  }
  if (count > 0) colour = sum / double(count);
  return count > 0;
}

/// Colours of vertices: means over the views that saw them or, if there are none, over all views whose image contains
/// them.
class Colours {
 public:
  explicit Colours(const scene::Scene& scene) : scene_(scene), all_(scene.train.size()) {
    for (std::uint32_t v = 0; v < all_.size(); ++v) all_[v] = v;
  }
  glm::vec3 at(const glm::dvec3& p, std::span<const std::uint32_t> views) const {
    glm::dvec3 colour(0.5);
    if (!add_colours(scene_, views, p, colour)) add_colours(scene_, all_, p, colour);
    return glm::vec3(colour);
  }
  glm::vec3 at(const glm::dvec3& p) const { return at(p, {}); }

 private:
  const scene::Scene& scene_;
  std::vector<std::uint32_t> all_;
};

/// Weight of each triangle's geometric error. A move by h along the normal shifts the triangle's image by up to focal h
/// / d pixels in a camera at distance d, over area (focal / d)^2 pixels. The squared error therefore grows with area
/// (focal / d)^4, summed over the views that saw its corners. Corners without sightings (of the sphere) use all views
/// with a weight of 0.01.
std::vector<double> picture_weights(const scene::Scene& scene, const soup::Mesh& mesh,
                                    std::span<const std::vector<std::uint32_t>> seen_by) {
  constexpr double kUnseen = 0.01, kNearest = 0.05;
  const auto from_view = [&](std::size_t view, const glm::dvec3& p) {
    const scene::Camera& camera = scene.train[view].camera;
    const double pixels = std::max(camera.fx, camera.fy) / std::max(kNearest, glm::distance(camera.centre(), p));
    return pixels * pixels * pixels * pixels;
  };
  std::vector<double> corners(mesh.positions.size(), 0.0), weights;
  parallel_for(static_cast<int>(corners.size()), 0, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const glm::dvec3 p(mesh.positions[i]);
    for (const std::uint32_t v : seen_by[i]) corners[i] += from_view(v, p);
    for (std::size_t v = 0; seen_by[i].empty() && v < scene.train.size(); ++v) corners[i] += kUnseen * from_view(v, p);
  });
  for (std::size_t k = 0; k + 2 < mesh.indices.size(); k += 3) {
    const std::uint32_t a = mesh.indices[k], b = mesh.indices[k + 1], c = mesh.indices[k + 2];
    const glm::dvec3 p(mesh.positions[a]), q(mesh.positions[b]), r(mesh.positions[c]);
    weights.push_back(glm::length(glm::cross(q - p, r - p)) * (corners[a] + corners[b] + corners[c]));
  }
  return weights;
}

}  // namespace

std::vector<glm::vec3> backdrop_triangles(double radius) {
  const double g = (1.0 + std::sqrt(5.0)) / 2.0;
  const std::array<glm::dvec3, 12> corners{{{-1, g, 0},
                                            {1, g, 0},
                                            {-1, -g, 0},
                                            {1, -g, 0},
                                            {0, -1, g},
                                            {0, 1, g},
                                            {0, -1, -g},
                                            {0, 1, -g},
                                            {g, 0, -1},
                                            {g, 0, 1},
                                            {-g, 0, -1},
                                            {-g, 0, 1}}};
  std::vector<glm::vec3> triangles;
  const auto add = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
    for (const glm::dvec3& p : {a, b, c}) triangles.emplace_back(radius * glm::normalize(p));
  };
  // The faces of the icosahedron are the triples of corners at distance 2, its edge length. Each is divided into four.
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) { return glm::length(a - b) < 2.1; };
  for (std::size_t i = 0; i < 12; ++i)
    for (std::size_t j = i + 1; j < 12; ++j)
      for (std::size_t k = j + 1; k < 12; ++k) {
        const glm::dvec3 &a = corners[i], &b = corners[j], &c = corners[k];
        if (!near(a, b) || !near(b, c) || !near(a, c)) continue;
        const glm::dvec3 ab = a + b, bc = b + c, ca = c + a;
        add(a, ab, ca), add(ab, b, bc), add(ca, bc, c), add(ab, bc, ca);
      }
  return triangles;
}

Start surface_start(const scene::Scene& scene, const Settings& settings) {
  if (scene.points.positions.empty())
    throw Error("{}: has no points to start from; set `init` to random or to a mesh file", scene.path.string());
  const Thinned chosen = thinned(scene.points, usable_points(scene.points), kMostPoints);
  std::vector<glm::dvec3> points, cameras;
  for (const std::uint32_t i : chosen.chosen) points.emplace_back(scene.points.positions[i]);
  auto [seen_by, weights] = merged_sightings(scene, chosen);
  for (const scene::View& view : scene.train) cameras.push_back(view.camera.centre());
  double radius = kShellRadius * settings.backdrop;
  if (!(radius > 0)) radius = 2.0 * reach_of(scene).farthest;
  for (int i = 0; i < kShellPoints; ++i) points.push_back(radius * sphere_lattice(i, kShellPoints));
  seen_by.resize(points.size()), weights.resize(points.size());

  const std::vector<glm::dvec3> near = drawn_in(points, cameras);
  soup::Mesh mesh = soup::surface_from_sightings({near, seen_by, cameras, weights}, {});
  for (std::size_t i = 0; i < points.size(); ++i) mesh.positions[i] = glm::vec3(points[i]);
  const std::vector<glm::vec3> backdrop =
      settings.backdrop > 0 ? backdrop_triangles(settings.backdrop) : std::vector<glm::vec3>{};
  const std::vector<double> picture = picture_weights(scene, mesh, seen_by);
  std::size_t all = settings.triangles;
  if (surface_decides_budget(settings))
    all = surface_budget(scene, mesh, picture, settings.least_shift, std::max<std::size_t>(1, all / 8), all);
  const std::size_t behind = backdrop.size() / 3, budget = all > 4 * behind ? all - behind : all;
  const Colours colours(scene);
  std::vector<std::optional<glm::vec3>> colour_of(points.size());
  Start start;
  for (const std::uint32_t i : soup::decimate_views(mesh, picture, budget)) {
    if (!colour_of[i]) colour_of[i] = colours.at(points[i], seen_by[i]);
    start.vertices.emplace_back(points[i]);
    start.colours.push_back(*colour_of[i]);
  }
  if (all <= 4 * behind) return start;
  start.opaque = behind;
  for (const glm::vec3& p : backdrop) start.vertices.push_back(p), start.colours.push_back(colours.at(glm::dvec3(p)));
  return start;
}

}  // namespace trisoup::train
