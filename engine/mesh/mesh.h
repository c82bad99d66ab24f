// Reads triangle meshes. A soup starts from positions and triangles; everything else is ignored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Indexed triangles in file coordinates.
struct Mesh {
  std::vector<glm::vec3> positions;
  std::vector<std::uint32_t> indices;  // 3 per triangle
  std::size_t triangles() const { return indices.size() / 3; }
};

/// Reads .obj, .ply, .gltf or .glb, selected by the file extension. Polygons become triangle fans. Throws Error if the
/// file cannot be read, has no faces, or has an index out of range or a position that is not finite.
Mesh read_mesh(const std::filesystem::path& path);

/// Readers of files in memory. `name` begins error messages.
Mesh read_obj(std::span<const std::byte> bytes, const std::string& name);
Mesh read_ply(std::span<const std::byte> bytes, const std::string& name);  // ASCII, or binary in either byte order

/// Reads glTF 2.0, JSON or binary. External buffers are read from `folder`. Reads all meshes of the default scene,
/// transformed by their nodes. Images, materials, skins, points and lines are ignored.
Mesh read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder, const std::string& name);

/// Throws Error unless the mesh has a face, all indices are in range and all positions they use are finite. Every
/// reader calls it last.
void check_mesh(const Mesh& mesh, const std::string& name);

}  // namespace trisoup::soup
