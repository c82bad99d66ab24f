// Triangle meshes of other programs, reduced to what a soup starts from: positions and triangles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::soup {

/// Indexed triangles in the coordinates of the file.
struct Mesh {
  std::vector<glm::vec3> positions;
  std::vector<std::uint32_t> indices;  // 3 per triangle
  std::size_t triangles() const { return indices.size() / 3; }
};

/// Reads .obj, .ply, .gltf or .glb, by the name's ending. Polygons become fans of triangles.
/// Throws Error if the file cannot be read, has no faces, an index out of range, or a position that is no finite
/// number.
Mesh read_mesh(const std::filesystem::path& path);

/// The same from memory; `name` begins error messages.
Mesh read_obj(std::span<const std::byte> bytes, const std::string& name);
Mesh read_ply(std::span<const std::byte> bytes, const std::string& name);  // ascii, binary of either byte order

/// glTF 2.0, JSON or binary. Buffers in other files are looked for in `folder`. All meshes of the default scene,
/// transformed by their nodes; images, materials and skins are ignored, as are points and lines.
Mesh read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder, const std::string& name);

/// Throws Error unless there is a face, all indices are in range and all positions they use are finite. Every reader
/// ends with it.
void check_mesh(const Mesh& mesh, const std::string& name);

}  // namespace trisoup::soup
