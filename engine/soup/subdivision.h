// Which triangles a soup consists of: dropping those that are not seen and bisecting those that are too long.
// Section 3.4 of Tojo, Bickel, Umetani, "DiffSoup", CVPR 2026.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Barycentrics of a new triangle's three corners in its parent: corners[k] = (b0, b1, b2) of corner k, each summing
/// to 1.
using Corners = std::array<glm::vec3, 3>;
inline constexpr Corners kWholeParent{glm::vec3{1, 0, 0}, glm::vec3{0, 1, 0}, glm::vec3{0, 0, 1}};

/// A changed soup and where each of its triangles comes from, so that textures and optimiser state can follow.
struct Resampled {
  std::vector<glm::vec3> vertices;      // 3 per triangle
  std::vector<std::uint32_t> face_map;  // per triangle: the input triangle it descends from (or is)
  std::vector<Corners> corners;         // per triangle; kWholeParent if it was not split
  std::size_t triangles() const { return face_map.size(); }
};

/// The view in which edges are measured. `clip` maps the column vector (x, y, z, 1) to clip coordinates, z in [-w, w].
struct ScreenView {
  glm::mat4 clip{1.0f};
  int width = 0, height = 0;  // pixels; only their ratio counts
};

/// The triangles to keep so that at most `budget` remain: the least visible ones go, of equals those of lower index
/// first. counts: pixels won, per triangle. Returns ascending indices.
std::vector<std::uint32_t> most_visible(std::span<const std::uint32_t> counts, std::size_t budget);

/// The triangles with counts >= threshold, ascending.
std::vector<std::uint32_t> visible_at_least(std::span<const std::uint32_t> counts, std::uint32_t threshold = 1);

/// The soup of the triangles `kept`, in that order. vertices: 3 per triangle, as for all functions below.
Resampled keep(std::span<const glm::vec3> vertices, std::span<const std::uint32_t> kept);

/// Bisects the longest edge of the whole soup at its midpoint, again and again, until there are `target` triangles.
/// A soup that has as many already is returned as it is; one whose every edge has length 0, or is not finite, stays
/// smaller.
///
/// Bisecting edge (a, b) opposite to c gives two triangles. The one that keeps the parent's place in the order is (a,
/// m, c), the one appended at the end is (m, b, c), where (a, b) = (v0, v1), (v1, v2) or (v2, v0) as the triangle is
/// stored then. `corners` say the same in barycentrics of the input triangle, over repeated bisections.
Resampled bisect_longest(std::span<const glm::vec3> vertices, std::size_t target);

/// Bisects until no edge is longer than `longest` (> 0, world units), or max_splits bisections are done.
/// The number of triangles is bounded only by that: pass a cap where the scale of the soup is not known.
Resampled bisect_longer_than(std::span<const glm::vec3> vertices, float longest,
                             std::optional<std::size_t> max_splits = std::nullopt);

/// Bisects until no edge of the marked triangles is longer on screen than `fraction` of the image height, the longest
/// first, or until max_splits bisections are done. Edges with an end outside the cube -1..1 of normalised device
/// coordinates, or not in front of the camera, are left alone. An edge is cut where its screen midpoint lies on it, so
/// halves differ in world length. marked: one byte per triangle, nonzero to take part; descendants take part too.
/// Empty: all do.
Resampled bisect_on_screen(std::span<const glm::vec3> vertices, const ScreenView& view, float fraction,
                           std::span<const std::uint8_t> marked = {},
                           std::optional<std::size_t> max_splits = std::nullopt);

/// bisect_on_screen for one view after the other, in the order given.
/// visible: per view, one byte per *input* triangle, nonzero if it is visible there; descendants of a visible triangle
/// take part whether they are visible themselves or not, as in the published release. max_splits caps all views
/// together.
Resampled bisect_on_screens(std::span<const glm::vec3> vertices, std::span<const ScreenView> views, float fraction,
                            std::span<const std::vector<std::uint8_t>> visible,
                            std::optional<std::size_t> max_splits = std::nullopt);

/// Bisects the longest edge of the largest triangle at its midpoint, again and again, until there are `target`
/// triangles. Halves have half of a triangle's size; those whose halves would be smaller than `smallest` are left
/// alone. sizes: one per triangle.
Resampled bisect_largest(std::span<const glm::vec3> vertices, std::span<const double> sizes, double smallest,
                         std::size_t target);

/// The change `second` of the soup that `first` produced, as one change of the soup that `first` was given.
Resampled compose(const Resampled& first, Resampled second);

}  // namespace trisoup::soup
