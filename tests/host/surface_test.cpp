// Tests engine/mesh/delaunay.h and engine/mesh/surface.h.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "mesh/delaunay.h"
#include "mesh/surface.h"
#include "soup/random.h"

using namespace trisoup;
using namespace trisoup::soup;

namespace {

double volume(const std::vector<glm::dvec3>& p, const std::array<std::uint32_t, 4>& c) {
  return std::abs(glm::determinant(glm::dmat3(p[c[1]] - p[c[0]], p[c[2]] - p[c[0]], p[c[3]] - p[c[0]]))) / 6;
}

/// True if `p` lies inside the sphere through four corners, by more than rounding errors.
bool within_sphere(const std::vector<glm::dvec3>& points, const std::array<std::uint32_t, 4>& c, const glm::dvec3& p) {
  const glm::dvec3 o = points[c[0]];
  const glm::dmat3 rows = glm::transpose(glm::dmat3(points[c[1]] - o, points[c[2]] - o, points[c[3]] - o));
  glm::dvec3 right;
  for (int k = 0; k < 3; ++k)
    right[k] = 0.5 * glm::dot(points[c[std::size_t(k) + 1]] - o, points[c[std::size_t(k) + 1]] - o);
  const glm::dvec3 centre = glm::inverse(rows) * right;
  return glm::length(p - o - centre) < glm::length(centre) * (1 - 1e-6);
}

/// True if the segment from a to b intersects a triangle well before its end. Faces near the point are no
/// contradiction.
bool crosses(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& p, const glm::dvec3& q, const glm::dvec3& r) {
  const glm::dmat3 m(b - a, p - q, p - r);
  if (std::abs(glm::determinant(m)) < 1e-14) return false;
  const glm::dvec3 s = glm::inverse(m) * (p - a);
  return s.x > 1e-6 && s.x < 0.8 && s.y > 1e-9 && s.z > 1e-9 && s.y + s.z < 1 - 1e-9;
}

/// Points on the walls of the cube -1..1, seen by cameras near its centre. close() adds a sphere of unseen points
/// around.
struct Room {
  std::vector<glm::dvec3> points, cameras;
  std::vector<std::vector<std::uint32_t>> seen_by;
  explicit Room(int count) {
    Random random(5);
    for (int i = 0; i < 6; ++i) cameras.push_back(0.2 * glm::dvec3(random.in_sphere()));
    for (int i = 0; i < count; ++i) {
      glm::dvec3 p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      p[i % 3] = i % 2 ? 1 : -1;
      points.push_back(p);
      seen_by.push_back({0, 1, 2, 3, 4, 5});
    }
  }
  void close() {
    for (int i = 0; i < 100; ++i) {
      const double z = 1 - (2.0 * i + 1) / 100, r = std::sqrt(1 - z * z);
      points.push_back(6.0 * glm::dvec3(r * std::cos(2.4 * i), r * std::sin(2.4 * i), z));
    }
    seen_by.resize(points.size());
  }
  Mesh surface() const { return surface_from_sightings({points, seen_by, cameras}, {}); }
};

}  // namespace

TEST_CASE("circumspheres of Delaunay tetrahedra are empty, and the tetrahedra fill the hull", "[delaunay]") {
  Random random(1);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(i & 1, (i >> 1) & 1, i >> 2);
  for (int i = 0; i < 200; ++i) points.emplace_back(random.uniform01(), random.uniform01(), random.uniform01());
  const Tetrahedra t = delaunay(points);
  double sum = 0;
  int within = 0, one_sided = 0;
  for (std::uint32_t i = 0; i < t.size(); ++i) {
    sum += volume(points, t.corners[i]);
    if (volume(points, t.corners[i]) > 1e-7)
      for (const glm::dvec3& p : points) within += within_sphere(points, t.corners[i], p);
    for (const std::uint32_t n : t.across[i])
      if (n != Tetrahedra::kOutside) one_sided += std::count(t.across[n].begin(), t.across[n].end(), i) != 1;
  }
  CHECK(sum == Approx(1.0).epsilon(1e-6));
  CHECK(within == 0);
  CHECK(one_sided == 0);
  CHECK(delaunay(points).corners == t.corners);
}

TEST_CASE("degenerate points are refused", "[delaunay]") {
  std::vector<glm::dvec3> plane;
  for (int i = 0; i < 30; ++i) plane.emplace_back(i % 5, i / 5, 0);
  // Joggled input may give slivers; it must not crash or hang.
  try {
    delaunay(plane);
  } catch (const Error&) {
  }
  CHECK_THROWS_AS(delaunay(std::vector<glm::dvec3>(4)), Error);
}

TEST_CASE("the walls of a room become a closed surface that no line of sight crosses", "[surface]") {
  Room room(600);
  room.close();
  const Mesh mesh = room.surface();
  REQUIRE(mesh.triangles() > 500);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (std::size_t k = 0; k < mesh.indices.size(); k += 3)
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = mesh.indices[k + e], b = mesh.indices[k + (e + 1) % 3];
      ++edges[{a, b}], --edges[{b, a}];
    }
  // Faces use every edge equally often in both directions.
  CHECK(std::all_of(edges.begin(), edges.end(), [](const auto& e) { return e.second == 0; }));
  int crossed = 0;
  for (std::size_t i = 0; i < 600; i += 7)
    for (const glm::dvec3& camera : room.cameras)
      for (std::size_t k = 0; k < mesh.indices.size(); k += 3) {
        const auto at = [&](std::size_t e) { return room.points[mesh.indices[k + e]]; };
        crossed += crosses(camera, room.points[i], at(0), at(1), at(2));
      }
  CHECK(crossed == 0);
  // The surface uses only points on the walls, none of the sphere.
  CHECK(std::all_of(mesh.indices.begin(), mesh.indices.end(), [](std::uint32_t i) { return i < 600; }));
}

TEST_CASE("an outlier inside a room is ignored, because lines of sight pass through it", "[surface]") {
  Room room(600);
  const auto stray = static_cast<std::uint32_t>(room.points.size());
  room.points.emplace_back(0.5, 0.4, 0.1);
  room.seen_by.push_back({0, 1});
  room.close();
  const Mesh mesh = room.surface();
  CHECK(std::count(mesh.indices.begin(), mesh.indices.end(), stray) == 0);
}

TEST_CASE("sightings weigh as many as they stand for", "[surface]") {
  // Two cameras look at a point through another: the heavier one is right.
  for (const bool near_is_heavy : {false, true}) {
    Room room(0);
    room.cameras = {{0.1, 0, 0}, {-0.1, 0, 0}};
    room.close();
    std::vector<std::vector<float>> weights(room.points.size());
    std::vector<std::uint32_t> near, far;
    for (int y = -3; y <= 3; ++y)
      for (int x = -3; x <= 3; ++x)
        for (const double z : {1.0, 3.0}) {
          (z < 2 ? near : far).push_back(static_cast<std::uint32_t>(room.points.size()));
          room.points.emplace_back(0.2 * z * x, 0.2 * z * y + 0.003 * x, z + 0.001 * y);
          room.seen_by.push_back({0, 1});
          const float weight = (z < 2) == near_is_heavy ? 20.0f : 1.0f;
          weights.push_back({weight, weight});
        }
    const Mesh mesh = surface_from_sightings({room.points, room.seen_by, room.cameras, weights}, {});
    const auto used = [&](std::uint32_t point) {
      return std::find(mesh.indices.begin(), mesh.indices.end(), point) != mesh.indices.end();
    };
    CHECK(used(near[24]) == near_is_heavy);  // the middle one
    CHECK(used(far[24]) != near_is_heavy);
  }
}

TEST_CASE("without observations the surface is the surrounding sphere", "[surface]") {
  Room room(0);
  room.close();
  const Mesh mesh = room.surface();
  CHECK(mesh.triangles() >= 4);
}
