// Tests engine/mesh/triangle_distance.cpp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>

#include "mesh/triangle_distance.h"
#include "soup/random.h"

using namespace trisoup;
using soup::Corners3;

namespace {

glm::dvec3 random_point(soup::Random& random) {
  const double x = random.uniform01(), y = random.uniform01(), z = random.uniform01();
  return {x, y, z};
}

/// The smallest distance between points of a lattice on each triangle: at least the true distance, and above it by at
/// most the spacing of the lattices.
double sampled_distance(const Corners3& a, const Corners3& b, int side) {
  double best = std::numeric_limits<double>::infinity();
  const auto each = [side](const Corners3& t, auto&& f) {
    for (int i = 0; i <= side; ++i)
      for (int j = 0; i + j <= side; ++j)
        f(t[0] + (double(i) / side) * (t[1] - t[0]) + (double(j) / side) * (t[2] - t[0]));
  };
  each(a,
       [&](const glm::dvec3& p) { each(b, [&](const glm::dvec3& q) { best = std::min(best, glm::distance(p, q)); }); });
  return best;
}

}  // namespace

TEST_CASE("distances of triangles: corner, edge, face, and 0 if they intersect") {
  const Corners3 a{glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)};
  const auto moved = [&](const glm::dvec3& by) { return Corners3{a[0] + by, a[1] + by, a[2] + by}; };
  CHECK(soup::distance(a, a) == 0);
  CHECK(soup::distance(a, moved({0, 0, 0.25})) == Approx(0.25));
  CHECK(soup::distance(a, moved({2, 0, 0})) == Approx(1));
  CHECK(soup::distance(a, moved({0, -1.5, 0})) == Approx(0.5));
  // An edge above an edge: no corner of either is near.
  const Corners3 across{glm::dvec3(0.5, -1, 0.3), glm::dvec3(0.5, 1, 0.3), glm::dvec3(0.5, 0, 2)};
  CHECK(soup::distance(a, across) == Approx(0.3));
  // A spike through the middle of the face.
  const Corners3 spike{glm::dvec3(0.2, 0.2, -1), glm::dvec3(0.21, 0.2, 1), glm::dvec3(0.2, 0.21, 1)};
  CHECK(soup::distance(a, spike) == 0);
  CHECK(soup::distance(spike, a) == 0);
}

TEST_CASE("triangles without area have distances") {
  const glm::dvec3 p(1, 2, 3), q(1, 2, 4);
  CHECK(soup::distance({p, p, p}, {q, q, q}) == Approx(1));
  CHECK(soup::distance({p, q, p}, {p + glm::dvec3(2, 0, 0), q + glm::dvec3(2, 0, 0), q + glm::dvec3(2, 0, 0)}) ==
        Approx(2));
}

TEST_CASE("distances agree with those of points on random triangles") {
  soup::Random random(7);
  int apart = 0;
  for (int i = 0; i < 60; ++i) {
    Corners3 a, b;
    for (std::size_t k = 0; k < 3; ++k)
      a[k] = random_point(random), b[k] = random_point(random) + glm::dvec3(0.5, 0, 0);
    const double exact = soup::distance(a, b), sampled = sampled_distance(a, b, 24);
    CHECK(exact == Approx(soup::distance(b, a)).margin(1e-12));
    CHECK(exact <= sampled + 1e-12);
    CHECK(exact >= sampled - 2 * 1.8 / 24);  // edges of at most 1.8, in 24 parts
    if (exact > 0) ++apart;
  }
  CHECK(apart > 10);
  CHECK(apart < 60);
}

TEST_CASE("the nearest point of a triangle is on its face, an edge or a corner") {
  const Corners3 a{glm::dvec3(0, 0, 0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0)};
  CHECK(glm::distance(soup::nearest_point(a, {0.2, 0.3, 5}), glm::dvec3(0.2, 0.3, 0)) < 1e-12);
  CHECK(glm::distance(soup::nearest_point(a, {0.4, -2, 1}), glm::dvec3(0.4, 0, 0)) < 1e-12);
  CHECK(glm::distance(soup::nearest_point(a, {1, 1, 0}), glm::dvec3(0.5, 0.5, 0)) < 1e-12);
  CHECK(glm::distance(soup::nearest_point(a, {-3, -1, 0}), glm::dvec3(0, 0, 0)) < 1e-12);
}
