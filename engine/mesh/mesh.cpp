#include "mesh/mesh.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>

#include "base/error.h"

namespace trisoup::soup {

void check_mesh(const Mesh& mesh, const std::string& name) {
  if (mesh.indices.empty()) throw Error("{}: has no faces; export the mesh with triangles", name);
  for (std::size_t k = 0; k < mesh.indices.size(); ++k) {
    const std::uint32_t index = mesh.indices[k];
    if (index >= mesh.positions.size())
      throw Error("{}: triangle {} uses vertex {} of {}; export the mesh again", name, k / 3, index,
                  mesh.positions.size());
    const glm::vec3& p = mesh.positions[index];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw Error("{}: vertex {} has a coordinate that is not finite; remove it or export the mesh again", name, index);
  }
}

Mesh read_mesh(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending != ".obj" && ending != ".ply" && ending != ".gltf" && ending != ".glb")
    throw Error("{}: unknown mesh format; use an .obj, .ply, .gltf or .glb file", name);

  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw Error("{}: cannot be opened ({}); check the path", name, error.message());
  std::ifstream file(path, std::ios::binary);
  std::vector<std::byte> bytes(file ? size : 0);
  if (!file || !file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw Error("{}: cannot be read; check its permissions", name);

  if (ending == ".obj") return read_obj(bytes, name);
  if (ending == ".ply") return read_ply(bytes, name);
  return read_gltf(bytes, path.parent_path(), name);
}

}  // namespace trisoup::soup
