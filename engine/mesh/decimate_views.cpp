#include "mesh/decimate_views.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <queue>
#include <tuple>

#include <glm/glm.hpp>

#include "base/cancellation.h"

namespace trisoup::soup {
namespace {

/// Weight of the distance to the corner itself. It orders the collapses by edge length where all plane distances are
/// zero, as within a plane.
constexpr double kHold = 1e-3;

using Face = std::array<std::uint32_t, 3>;

/// A sum of weighted squared distances from a point to planes and points.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, x = 0, y = 0, z = 0, one = 0;

  /// Adds the plane n . p + d = 0 with unit normal n.
  void add_plane(const glm::dvec3& n, double d, double w) {
    xx += w * n.x * n.x, xy += w * n.x * n.y, xz += w * n.x * n.z, yy += w * n.y * n.y, yz += w * n.y * n.z,
        zz += w * n.z * n.z;
    x += w * n.x * d, y += w * n.y * d, z += w * n.z * d, one += w * d * d;
  }
  void add_point(const glm::dvec3& p, double w) {
    xx += w, yy += w, zz += w;
    x -= w * p.x, y -= w * p.y, z -= w * p.z, one += w * glm::dot(p, p);
  }
  void add(const Quadric& q) {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
    x += q.x, y += q.y, z += q.z, one += q.one;
  }
  double at(const glm::dvec3& p) const {
    return xx * p.x * p.x + yy * p.y * p.y + zz * p.z * p.z + 2 * (xy * p.x * p.y + xz * p.x * p.z + yz * p.y * p.z) +
           2 * (x * p.x + y * p.y + z * p.z) + one;
  }
};

/// Which collapses are allowed. Each level allows more and is used only when the previous one has no candidates left.
enum class Allowed { as_it_is, folds, anything };

class Decimation {
 public:
  Decimation(const Mesh& mesh, std::span<const double> weights)
      : faces_of_(mesh.positions.size()), quadrics_(mesh.positions.size()), changes_(mesh.positions.size(), 0) {
    for (const glm::vec3& p : mesh.positions) at_.emplace_back(p);
    for (std::uint32_t f = 0; f < mesh.triangles(); ++f) {
      faces_.push_back({mesh.indices[3 * f], mesh.indices[3 * f + 1], mesh.indices[3 * f + 2]});
      add_face(f, weights[f]);
    }
  }

  /// Looks at all edges, also at those that could not be collapsed before.
  void consider_all() {
    queue_ = {};
    for (std::uint32_t v = 0; v < at_.size(); ++v)
      for (const std::uint32_t u : neighbours(v)) push(v, u);
  }

  void down_to(std::size_t budget, Allowed allowed) {
    while (alive_ > budget && !queue_.empty()) {
      check_cancellation();
      const Candidate c = queue_.top();
      queue_.pop();
      if (changes_[c.from] != c.from_changes || changes_[c.to] != c.to_changes || !possible(c.from, c.to, allowed))
        continue;
      if (at_edge(c.from, c.to) == alive_) return leave_only(budget);
      error_ += c.cost - quadrics_[c.from].at(at_[c.from]) - quadrics_[c.to].at(at_[c.to]);
      collapse(c.from, c.to);
    }
  }

  std::size_t triangles() const { return alive_; }
  /// Sum of the quadrics at their corners, less that of the whole mesh.
  double error() const { return error_; }

  std::vector<std::uint32_t> indices() const {
    std::vector<std::uint32_t> result;
    for (const Face& face : faces_)
      if (face[0] != kGone) result.insert(result.end(), face.begin(), face.end());
    return result;
  }

 private:
  static constexpr std::uint32_t kGone = ~0u;

  struct Candidate {
    double cost;
    std::uint32_t from, to, from_changes, to_changes;
    /// std::priority_queue pops the largest. Ties are ordered by index, so the result is deterministic.
    bool operator<(const Candidate& o) const { return std::tie(o.cost, o.from, o.to) < std::tie(cost, from, to); }
  };

  static bool has(const Face& face, std::uint32_t v) { return face[0] == v || face[1] == v || face[2] == v; }
  glm::dvec3 normal(const Face& f) const { return glm::cross(at_[f[1]] - at_[f[0]], at_[f[2]] - at_[f[0]]); }

  void add_face(std::uint32_t f, double weight) {
    const Face& face = faces_[f];
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      faces_[f][0] = kGone;
      return;
    }
    ++alive_;
    const glm::dvec3 cross = normal(face);
    const double length = glm::length(cross);
    for (const std::uint32_t v : face) {
      faces_of_[v].push_back(f);
      if (length > 0) quadrics_[v].add_plane(cross / length, -glm::dot(cross / length, at_[v]), weight);
      quadrics_[v].add_point(at_[v], kHold * weight);
    }
  }

  std::size_t at_edge(std::uint32_t a, std::uint32_t b) const {
    return static_cast<std::size_t>(
        std::count_if(faces_of_[a].begin(), faces_of_[a].end(), [&](std::uint32_t f) { return has(faces_[f], b); }));
  }

  /// Called when a collapse would remove every remaining face. Keeps the first `budget` faces instead, so that the soup
  /// is not empty.
  void leave_only(std::size_t budget) {
    std::size_t left = 0;
    for (Face& face : faces_)
      if (face[0] != kGone && ++left > budget) face[0] = kGone;
    alive_ = std::min(alive_, budget);
  }

  std::vector<std::uint32_t> neighbours(std::uint32_t v) const {
    std::vector<std::uint32_t> all;
    for (const std::uint32_t f : faces_of_[v])
      for (const std::uint32_t u : faces_[f])
        if (u != v) all.push_back(u);
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  void push(std::uint32_t from, std::uint32_t to) {
    Quadric both = quadrics_[from];
    both.add(quadrics_[to]);
    queue_.push({both.at(at_[to]), from, to, changes_[from], changes_[to]});
  }

  bool possible(std::uint32_t from, std::uint32_t to, Allowed allowed) const {
    std::size_t shared = 0;
    for (const std::uint32_t f : faces_of_[from]) {
      if (has(faces_[f], to)) {
        ++shared;
        continue;
      }
      Face moved = faces_[f];
      std::replace(moved.begin(), moved.end(), from, to);
      if (allowed == Allowed::as_it_is && glm::dot(normal(faces_[f]), normal(moved)) < 0) return false;
    }
    if (allowed == Allowed::anything) return shared > 0;
    // The link condition: every common neighbour of both ends must be the third corner of a triangle at their edge.
    // Otherwise the collapse would close a hole or a handle. A tetrahedron may be flattened to two coincident
    // triangles: a floating part has no smaller form.
    const std::vector<std::uint32_t> a = neighbours(from), b = neighbours(to);
    std::vector<std::uint32_t> both;
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
    return shared > 0 && both.size() == shared;
  }

  void collapse(std::uint32_t from, std::uint32_t to) {
    for (const std::uint32_t f : faces_of_[from]) {
      Face& face = faces_[f];
      if (has(face, to)) {
        for (const std::uint32_t v : face)
          if (v != from) std::erase(faces_of_[v], f);
        face[0] = kGone;
        --alive_;
      } else {
        std::replace(face.begin(), face.end(), from, to);
        faces_of_[to].push_back(f);
      }
    }
    faces_of_[from].clear();
    quadrics_[to].add(quadrics_[from]);
    ++changes_[from];
    ++changes_[to];
    for (const std::uint32_t v : neighbours(to)) {
      push(to, v);
      push(v, to);
    }
  }

  std::vector<glm::dvec3> at_;
  std::vector<Face> faces_;  // removed faces have first corner kGone
  std::vector<std::vector<std::uint32_t>> faces_of_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> changes_;  // per corner, number of changes; queue entries with an older number are stale
  std::priority_queue<Candidate> queue_;
  std::size_t alive_ = 0;
  double error_ = 0;
};

}  // namespace

std::vector<std::uint32_t> decimate_views(const Mesh& mesh, std::span<const double> weights, std::size_t budget) {
  Decimation decimation(mesh, weights);
  for (const Allowed allowed : {Allowed::as_it_is, Allowed::folds, Allowed::anything}) {
    if (decimation.triangles() <= budget) break;
    decimation.consider_all();
    decimation.down_to(budget, allowed);
  }
  return decimation.indices();
}

std::vector<double> decimation_errors(const Mesh& mesh, std::span<const double> weights,
                                      std::span<const std::size_t> sizes) {
  Decimation decimation(mesh, weights);
  decimation.consider_all();
  std::vector<double> errors;
  for (const std::size_t size : sizes) {
    decimation.down_to(size, Allowed::as_it_is);
    errors.push_back(decimation.triangles() <= size ? decimation.error() : std::numeric_limits<double>::infinity());
  }
  return errors;
}

}  // namespace trisoup::soup
