#include "mesh/delaunay.h"

#include <algorithm>
#include <cstdio>
#include <memory>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "base/error.h"

namespace trisoup::soup {
namespace {

/// Frees Qhull's state on destruction.
struct Qhull {
  qhT state;
  Qhull() { qh_zero(&state, nullptr); }
  ~Qhull() {
    qh_freeqhull(&state, qh_ALL);
    int left = 0, bytes = 0;
    qh_memfreeshort(&state, &left, &bytes);
  }
  Qhull(const Qhull&) = delete;
  Qhull& operator=(const Qhull&) = delete;
};

}  // namespace

Tetrahedra delaunay(std::span<const glm::dvec3> points) {
  if (points.size() < 5)
    throw Error("points: {} points, at least 5 are needed; use a dataset with more points", points.size());
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const glm::dvec3& p : points) coordinates.insert(coordinates.end(), {p.x, p.y, p.z});

  Qhull hull;
  qhT* qh = &hull.state;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> silence(std::fopen("/dev/null", "w"), &std::fclose);
  char command[] = "qhull d QJ Pp";
  if (qh_new_qhull(qh, 3, static_cast<int>(points.size()), coordinates.data(), False, command, nullptr,
                   silence.get()) != 0)
    throw Error("points: all {} are coplanar or identical; use a dataset with a valid point cloud", points.size());

  Tetrahedra result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const coordT* p = qh->first_point + i * static_cast<std::size_t>(qh->hull_dim);
    result.points.emplace_back(p[0], p[1], p[2]);
  }
  // A facet of the lower hull of the points lifted to four dimensions is a Delaunay tetrahedron.
  std::vector<std::uint32_t> number_of(qh->facet_id, Tetrahedra::kOutside);
  facetT *facet, *neighbor, **neighborp;
  vertexT *vertex, **vertexp;
  FORALLfacet_(qh->facet_list) {
    if (facet->upperdelaunay || !facet->simplicial) continue;
    number_of[facet->id] = static_cast<std::uint32_t>(result.size());
    std::array<std::uint32_t, 4> corners{};
    std::size_t k = 0;
    FOREACHvertex_(facet->vertices) if (k < 4) corners[k++] = static_cast<std::uint32_t>(qh_pointid(qh, vertex->point));
    result.corners.push_back(corners);
  }
  result.across.resize(result.size(),
                       {Tetrahedra::kOutside, Tetrahedra::kOutside, Tetrahedra::kOutside, Tetrahedra::kOutside});
  FORALLfacet_(qh->facet_list) {
    const std::uint32_t t = number_of[facet->id];
    if (t == Tetrahedra::kOutside) continue;
    FOREACHneighbor_(facet) {
      const std::uint32_t n = number_of[neighbor->id];
      if (n == Tetrahedra::kOutside) continue;
      const auto& there = result.corners[n];
      for (std::size_t k = 0; k < 4; ++k)
        if (std::find(there.begin(), there.end(), result.corners[t][k]) == there.end()) result.across[t][k] = n;
    }
  }
  if (result.corners.empty())
    throw Error("points: the {} points have no tetrahedron; use a dataset with a valid point cloud", points.size());
  return result;
}

}  // namespace trisoup::soup
