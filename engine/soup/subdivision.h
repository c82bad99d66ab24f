// Refinement of a soup: drops invisible triangles and splits long ones by bisection. Section 3.4 of Tojo, Bickel,
// Umetani, "DiffSoup", CVPR 2026.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Barycentric coordinates of a new triangle's three corners in its parent: corners[k] = (b0, b1, b2) of corner k, each
/// summing to 1.
using Corners = std::array<glm::vec3, 3>;
inline constexpr Corners kWholeParent{glm::vec3{1, 0, 0}, glm::vec3{0, 1, 0}, glm::vec3{0, 0, 1}};

/// A refined soup and the origin of each of its triangles. Textures and optimiser state are mapped with it.
struct Subdivision {
  std::vector<glm::vec3> vertices;      // 3 per triangle
  std::vector<std::uint32_t> face_map;  // per triangle: the input triangle it comes from
  std::vector<Corners> corners;         // per triangle; kWholeParent if it was not split
  std::size_t triangles() const { return face_map.size(); }
};

/// The view in which edges are measured. `clip` maps column vectors (x, y, z, 1) to clip coordinates, z in [-w, w].
struct ScreenView {
  glm::mat4 clip{1.0f};
  int width = 0, height = 0;  // pixels; only their ratio matters
};

/// Returns the `budget` most visible triangles as ascending indices, or all triangles if there are fewer. Among equally
/// visible ones the lower indices are dropped first. counts: visible pixels per triangle.
std::vector<std::uint32_t> most_visible(std::span<const std::uint32_t> counts, std::size_t budget);

/// Returns the triangles with counts >= threshold, ascending.
std::vector<std::uint32_t> visible_at_least(std::span<const std::uint32_t> counts, std::uint32_t threshold = 1);

/// Returns the soup of the triangles `kept`, in that order. vertices: 3 per triangle, as in all functions below.
Subdivision keep(std::span<const glm::vec3> vertices, std::span<const std::uint32_t> kept);

/// Repeatedly bisects the longest edge of the whole soup at its midpoint until there are `target` triangles. A soup
/// with at least `target` triangles is returned unchanged. Edges of length 0 and edges that are not finite are not
/// split, so the result can be smaller.
///
/// Bisecting edge (a, b) opposite c at m gives two triangles: (a, m, c) replaces the parent and (m, b, c) is appended,
/// where (a, b) = (v0, v1), (v1, v2) or (v2, v0) in the triangle's current order. `corners` holds the barycentric
/// coordinates in the input triangle, accumulated over repeated bisections.
Subdivision bisect_longest(std::span<const glm::vec3> vertices, std::size_t target);

/// Bisects until no edge is longer than `longest` (> 0, world units) or max_splits bisections are done. Nothing else
/// bounds the number of triangles; pass max_splits if the scale of the soup is not known.
Subdivision bisect_longer_than(std::span<const glm::vec3> vertices, float longest,
                               std::optional<std::size_t> max_splits = std::nullopt);

/// Bisects the marked triangles until no edge is longer on screen than `fraction` of the image height or max_splits
/// bisections are done. Longest edges are split first. Edges are not split if an end is behind the camera or outside
/// the cube -1..1 of normalised device coordinates. An edge is split at its screen-space midpoint, so the halves differ
/// in world length. marked: one byte per triangle; nonzero marks the triangle and its descendants. Empty marks all.
Subdivision bisect_on_screen(std::span<const glm::vec3> vertices, const ScreenView& view, float fraction,
                             std::span<const std::uint8_t> marked = {},
                             std::optional<std::size_t> max_splits = std::nullopt);

/// Applies bisect_on_screen to one view after the other. visible: per view, one byte per *input* triangle, nonzero if
/// it is visible in the view. Descendants of a visible triangle are split even if they are not visible themselves, as
/// in the published release. max_splits limits all views together.
Subdivision bisect_on_screens(std::span<const glm::vec3> vertices, std::span<const ScreenView> views, float fraction,
                              std::span<const std::vector<std::uint8_t>> visible,
                              std::optional<std::size_t> max_splits = std::nullopt);

/// Repeatedly bisects the longest edge of the largest triangle at its midpoint until there are `target` triangles. Each
/// half gets half of the size. Triangles whose halves would be smaller than `smallest` are not split. sizes: one per
/// triangle.
Subdivision bisect_largest(std::span<const glm::vec3> vertices, std::span<const double> sizes, double smallest,
                           std::size_t target);

/// Combines two refinements: `first` produced the soup that `second` refined. The result maps to the input of `first`.
Subdivision compose(const Subdivision& first, Subdivision second);

}  // namespace trisoup::soup
