#include "mesh/surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/parallel_for.h"
#include "mesh/delaunay.h"
#include "mesh/minimum_cut.h"
#include "mesh/point_spacing.h"

namespace trisoup::soup {
namespace {

constexpr std::uint32_t kOutside = Tetrahedra::kOutside;

/// Votes from sightings: the cost of labelling a tetrahedron as air or matter, and of a face between the two.
struct Votes {
  // Per tetrahedron: weight of the votes for each label.
  std::vector<double> air, matter;
  // [tetrahedron][face]: weight of the sightings that leave it through this face on their way to a point.
  std::vector<std::array<double, 4>> face;
};

/// Walks along line segments through the tetrahedra.
class Walker {
 public:
  explicit Walker(const Tetrahedra& tetrahedra) : points_(tetrahedra.points), tetrahedra_(tetrahedra) {
    std::vector<std::uint32_t> count(points_.size() + 1);
    for (const auto& corners : tetrahedra.corners)
      for (const std::uint32_t c : corners) ++count[c + 1];
    for (std::size_t i = 1; i < count.size(); ++i) count[i] += count[i - 1];
    first_ = count;
    around_.resize(first_.back());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t)
      for (const std::uint32_t c : tetrahedra.corners[t]) around_[count[c]++] = t;
  }

  /// Returns the tetrahedron at corner `point` that `direction` enters, or kOutside if it leaves the hull.
  std::uint32_t first_towards(std::uint32_t point, const glm::dvec3& direction) const {
    std::uint32_t best = kOutside;
    double best_inside = -1e-9;
    for (std::uint32_t i = first_[point]; i < first_[point + 1]; ++i) {
      const std::uint32_t t = around_[i];
      const double inside = cone(t, point, direction);
      if (inside > best_inside) best = t, best_inside = inside;
    }
    return best;
  }

  /// Calls visit(t, k, s) for every face that the segment from + s * direction, s < 1, crosses. It leaves tetrahedron t
  /// through the face opposite corner k at s. Returns the tetrahedron at s = 1, or kOutside.
  template <class Visit>
  std::uint32_t walk(std::uint32_t t, std::uint32_t came_from, const glm::dvec3& from, const glm::dvec3& direction,
                     Visit&& visit) const {
    for (std::size_t steps = 0; t != kOutside && steps < tetrahedra_.size(); ++steps) {
      double nearest = std::numeric_limits<double>::infinity();
      int exit = -1;
      for (int k = 0; k < 4; ++k) {
        if (tetrahedra_.across[t][static_cast<std::size_t>(k)] == came_from && came_from != kOutside) continue;
        const auto [distance, speed] = to_face(t, k, from, direction);
        if (speed > 0 && distance / speed < nearest) nearest = distance / speed, exit = k;
      }
      if (exit < 0 || nearest >= 1) return t;
      visit(t, static_cast<std::size_t>(exit), nearest);
      came_from = t;
      t = tetrahedra_.across[t][static_cast<std::size_t>(exit)];
    }
    return t;
  }

 private:
  /// Returns the distance of `from` to the face opposite corner k, along the face's outward normal, and the speed of
  /// `direction` towards it.
  std::pair<double, double> to_face(std::uint32_t t, int k, const glm::dvec3& from, const glm::dvec3& direction) const {
    const auto& c = tetrahedra_.corners[t];
    const auto at = [&](int i) { return points_[c[static_cast<std::size_t>((k + i) % 4)]]; };
    glm::dvec3 normal = glm::cross(at(2) - at(1), at(3) - at(1));
    if (glm::dot(normal, at(0) - at(1)) > 0) normal = -normal;
    return {glm::dot(normal, at(1) - from), glm::dot(normal, direction)};
  }

  /// Writes `direction` as a sum of the three edges at corner `point`. Returns the smallest coefficient divided by the
  /// sum of their absolute values: 0 or more if the direction points into the tetrahedron.
  double cone(std::uint32_t t, std::uint32_t point, const glm::dvec3& direction) const {
    glm::dmat3 edges(0.0);
    int n = 0;
    for (const std::uint32_t c : tetrahedra_.corners[t])
      if (c != point && n < 3) edges[n++] = points_[c] - points_[point];
    const double volume = glm::determinant(edges);
    if (volume == 0) return -1;
    const glm::dvec3 shares = glm::inverse(edges) * direction;
    const double min_share = std::min({shares.x, shares.y, shares.z});
    const double size = std::abs(shares.x) + std::abs(shares.y) + std::abs(shares.z);
    return size > 0 && std::isfinite(size) ? min_share / size : -1;
  }

  std::span<const glm::dvec3> points_;
  const Tetrahedra& tetrahedra_;
  std::vector<std::uint32_t> first_, around_;  // tetrahedra around each point, in compressed rows
};

/// A single vote, before it is added to Votes.
struct Vote {
  enum Kind : std::uint32_t { face0, face1, face2, face3, air, matter };
  std::uint32_t tetrahedron, kind;
  double weight;
};

/// Collects the votes of all sightings of point p.
void collect_votes(const Sightings& s, const Tetrahedra& tetrahedra, const Walker& walker, std::uint32_t p, double soft,
                   std::vector<Vote>& votes) {
  for (std::size_t i = 0; i < s.seen_by[p].size(); ++i) {
    const double weight = s.weights.empty() ? 1.0 : static_cast<double>(s.weights[p][i]);
    const glm::dvec3& from = tetrahedra.points[p];
    const glm::dvec3 way = s.cameras[s.seen_by[p][i]] - from;
    const double length = glm::length(way);
    if (!(length > 0)) continue;
    // The walk goes from the point to the camera. The sighting has the opposite direction, so it enters a tetrahedron
    // where the walk leaves it.
    const std::uint32_t first = walker.first_towards(p, way);
    if (first != kOutside) {
      const std::uint32_t last =
          walker.walk(first, kOutside, from, way, [&](std::uint32_t t, std::size_t k, double at) {
            const double d = at * length / soft;
            const std::uint32_t nearer = tetrahedra.across[t][k];
            if (nearer == kOutside) return;
            const auto& there = tetrahedra.across[nearer];
            const auto back = static_cast<std::uint32_t>(std::find(there.begin(), there.end(), t) - there.begin());
            if (back < 4) votes.push_back({nearer, back, weight * (1.0 - std::exp(-0.5 * d * d))});
          });
      if (last != kOutside) votes.push_back({last, Vote::air, weight});
    }
    if (const std::uint32_t behind = walker.first_towards(p, -way); behind != kOutside)
      votes.push_back({behind, Vote::matter, weight});
  }
}

Votes count_votes(const Sightings& s, const Tetrahedra& tetrahedra, const SurfaceOptions& options) {
  Votes votes;
  votes.air.resize(tetrahedra.size());
  votes.matter.resize(tetrahedra.size());
  votes.face.resize(tetrahedra.size());
  const Walker walker(tetrahedra);
  std::vector<glm::vec3> floats(s.points.begin(), s.points.end());
  const std::vector<double> spacing = nearest_distances(floats, 4);
  // All threads walk, but the votes are added in point order, so the sums do not depend on the number of threads.
  constexpr std::size_t kBlock = 256, kBlocks = 64;
  std::vector<std::vector<Vote>> collected(kBlocks);
  for (std::size_t begin = 0; begin < s.points.size(); begin += kBlocks * kBlock) {
    parallel_for(kBlocks, 0, [&](int block) {
      std::vector<Vote>& to = collected[static_cast<std::size_t>(block)];
      to.clear();
      const std::size_t first = begin + static_cast<std::size_t>(block) * kBlock,
                        last = std::min(first + kBlock, s.points.size());
      for (std::size_t p = first; p < last; ++p)
        collect_votes(s, tetrahedra, walker, static_cast<std::uint32_t>(p),
                      std::max(options.softness * spacing[p], 1e-12), to);
    });
    for (const std::vector<Vote>& of_block : collected)
      for (const Vote& vote : of_block) {
        if (vote.kind == Vote::air)
          votes.air[vote.tetrahedron] += vote.weight;
        else if (vote.kind == Vote::matter)
          votes.matter[vote.tetrahedron] += vote.weight;
        else
          votes.face[vote.tetrahedron][vote.kind] += vote.weight;
      }
  }
  // Cameras are in air, regardless of the sightings.
  constexpr double kSure = 1e6;
  const auto corner = static_cast<std::uint32_t>(s.points.size() - 1);
  for (const glm::dvec3& camera : s.cameras) {
    const glm::dvec3 way = camera - tetrahedra.points[corner];
    const std::uint32_t first = walker.first_towards(corner, way);
    if (first == kOutside) continue;
    const std::uint32_t there =
        walker.walk(first, kOutside, tetrahedra.points[corner], way, [](std::uint32_t, std::size_t, double) {});
    if (there != kOutside) votes.air[there] += kSure;
  }
  return votes;
}

/// Returns 1 - cos of the angle between a face and the circumsphere of its tetrahedron. It is small for faces that fit
/// the points well (Labatut 2009).
double sphere_angle(std::span<const glm::dvec3> points, const std::array<std::uint32_t, 4>& corners,
                    std::size_t opposite) {
  const auto at = [&](std::size_t i) { return points[corners[(opposite + i) % 4]]; };
  const glm::dvec3 a = at(1) - at(0), b = at(2) - at(0), c = at(3) - at(0);
  const double volume = 2.0 * glm::dot(a, glm::cross(b, c));
  if (volume == 0) return 1.0;
  const glm::dvec3 centre =
      (glm::dot(a, a) * glm::cross(b, c) + glm::dot(b, b) * glm::cross(c, a) + glm::dot(c, c) * glm::cross(a, b)) /
      volume;
  const glm::dvec3 normal = glm::cross(at(2) - at(1), at(3) - at(1));
  const double size = glm::length(normal) * glm::length(centre);
  if (!(size > 0)) return 1.0;
  // Positive towards the opposite corner.
  const double side = glm::dot(normal, at(0) - at(1)) > 0 ? 1.0 : -1.0;
  const double cosine = side * glm::dot(normal, at(0) + centre - at(1)) / size;
  return 1.0 - std::clamp(cosine, -1.0, 1.0);
}

/// Labels each tetrahedron as air (true) or matter by a minimum cut.
std::vector<bool> divide(const Tetrahedra& tetrahedra, const Votes& votes, const SurfaceOptions& options) {
  constexpr double kUnits = 1024;  // for a vote
  const auto units = [](double cost) { return static_cast<std::int64_t>(std::llround(cost * kUnits)); };
  CutNetwork network;
  const auto place = [&](std::uint32_t t, std::uint32_t neighbour) {
    const auto& across = tetrahedra.across[t];
    return static_cast<std::size_t>(std::find(across.begin(), across.end(), neighbour) - across.begin());
  };
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    double solid = votes.matter[t];
    auto& across = network.across.emplace_back(tetrahedra.across[t]);
    auto& back = network.back.emplace_back();
    auto& capacity = network.capacity.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t other = across[k];
      const double angle = sphere_angle(tetrahedra.points, tetrahedra.corners[t], k);
      if (other == kOutside) {
        solid += options.smoothness * angle;
        continue;
      }
      back[k] = static_cast<std::uint8_t>(place(other, t));
      if (back[k] >= 4 || place(t, other) != k) {  // flat tetrahedra may share two faces
        across[k] = CutNetwork::kNoNode;
        continue;
      }
      const double fit = std::max(angle, sphere_angle(tetrahedra.points, tetrahedra.corners[other], back[k]));
      capacity[k] = units(votes.face[t][k] + options.smoothness * fit);
    }
    network.source.push_back(units(votes.air[t]) - units(solid));
  }
  return minimum_cut(std::move(network));
}

}  // namespace

Mesh surface_from_sightings(const Sightings& sightings, const SurfaceOptions& options) {
  const Tetrahedra tetrahedra = delaunay(sightings.points);
  const Votes votes = count_votes(sightings, tetrahedra, options);
  const std::vector<bool> air = divide(tetrahedra, votes, options);
  Mesh mesh;
  for (const glm::dvec3& p : sightings.points) mesh.positions.emplace_back(p);
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t)
    for (std::size_t k = 0; air[t] && k < 4; ++k) {
      const std::uint32_t other = tetrahedra.across[t][k];
      if (other != kOutside && air[other]) continue;
      const auto& c = tetrahedra.corners[t];
      std::array<std::uint32_t, 3> face{c[(k + 1) % 4], c[(k + 2) % 4], c[(k + 3) % 4]};
      // Counter-clockwise as seen from the air side.
      const glm::dvec3 a = sightings.points[face[0]], b = sightings.points[face[1]], d = sightings.points[face[2]];
      if (glm::dot(glm::cross(b - a, d - a), sightings.points[c[k]] - a) < 0) std::swap(face[1], face[2]);
      mesh.indices.insert(mesh.indices.end(), face.begin(), face.end());
    }
  return mesh;
}

}  // namespace trisoup::soup
