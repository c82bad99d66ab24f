#include "mesh/decimate.h"

#include <meshoptimizer.h>

namespace trisoup::soup {
namespace {

Mesh weld(const Mesh& mesh) {
  std::vector<glm::vec3> positions = mesh.positions;
  for (glm::vec3& p : positions) p += 0.0f;  // meshoptimizer compares vertices by their bytes, so -0 must become 0
  std::vector<unsigned> remap(positions.size());
  const std::size_t unique = meshopt_generateVertexRemap(remap.data(), mesh.indices.data(), mesh.indices.size(),
                                                         positions.data(), positions.size(), sizeof(glm::vec3));
  Mesh welded;
  welded.positions.resize(unique);
  meshopt_remapVertexBuffer(welded.positions.data(), positions.data(), positions.size(), sizeof(glm::vec3),
                            remap.data());
  for (std::size_t k = 0; k + 2 < mesh.indices.size(); k += 3) {
    const std::uint32_t a = remap[mesh.indices[k]], b = remap[mesh.indices[k + 1]], c = remap[mesh.indices[k + 2]];
    const glm::dvec3 p(welded.positions[a]), q(welded.positions[b]), r(welded.positions[c]);
    if (glm::cross(q - p, r - p) != glm::dvec3(0.0)) welded.indices.insert(welded.indices.end(), {a, b, c});
  }
  return welded;
}

}  // namespace

Mesh decimate(const Mesh& mesh, std::size_t budget) {
  Mesh result = weld(mesh);
  if (result.triangles() <= budget) return result;

  // Errors are relative to the extent of the mesh and squared internally. This limit is never reached, so only the
  // budget matters.
  constexpr float kAnyError = 1e10f;
  const float* positions = &result.positions[0].x;
  std::vector<unsigned> indices(result.indices.size());
  const auto run = [&](auto simplify) {
    return simplify(indices.data(), result.indices.data(), result.indices.size(), positions, result.positions.size(),
                    sizeof(glm::vec3), 3 * budget, kAnyError);
  };
  std::size_t size = run([](auto... args) { return meshopt_simplify(args..., 0u, nullptr); });
  if (size > 3 * budget) size = run([](auto... args) { return meshopt_simplifySloppy(args..., nullptr); });
  indices.resize(size);

  result.indices = std::move(indices);
  return weld(result);  // removes vertices that are no longer used
}

}  // namespace trisoup::soup
