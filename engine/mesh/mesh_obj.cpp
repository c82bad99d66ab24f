// Reads Wavefront OBJ with tinyobjloader.
#include <algorithm>
#include <limits>
#include <string_view>

#include <tiny_obj_loader.h>

#include "base/error.h"
#include "mesh/mesh.h"

namespace trisoup::soup {

namespace {

/// tinyobjloader does not reject numbers such as "nan" and "1e999" reliably, so they are checked first.
void check_numbers(std::span<const std::byte> bytes, const std::string& name) {
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (int number = 1; !rest.empty(); ++number) {
    const std::size_t length = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, length);
    rest.remove_prefix(std::min(length + 1, rest.size()));
    if ((line.starts_with("v ") || line.starts_with("v\t")) &&
        line.find_first_not_of("0123456789+-.eE \t\r", 1) != std::string_view::npos)
      throw Error("{}: line {}: a vertex coordinate is not a number; export the mesh again", name, number);
  }
}

}  // namespace

Mesh read_obj(std::span<const std::byte> bytes, const std::string& name) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = false;  // its ear clipping reads positions before the indices are checked
  config.vertex_color = false;
  check_numbers(bytes, name);
  tinyobj::ObjReader reader;
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!reader.ParseFromString(text, "", config)) {
    std::string reason = reader.Error().substr(0, reader.Error().find('\n'));
    throw Error("{}: is damaged ({}); export the mesh again", name,
                reason.empty() ? "not an OBJ file" : reason.substr(0, 120));
  }

  Mesh mesh;
  const std::vector<tinyobj::real_t>& vertices = reader.GetAttrib().vertices;
  for (std::size_t k = 0; k + 2 < vertices.size(); k += 3)
    mesh.positions.emplace_back(vertices[k], vertices[k + 1], vertices[k + 2]);
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    // tinyobjloader counts the corners of a face in one byte, which wraps for larger faces.
    std::size_t corners_of_all = 0;
    for (const unsigned char corners : shape.mesh.num_face_vertices) corners_of_all += corners;
    if (corners_of_all != shape.mesh.indices.size())
      throw Error("{}: has a face of more than 255 corners; triangulate the mesh", name);
    std::size_t first = 0;
    for (const unsigned char corners : shape.mesh.num_face_vertices) {
      const auto corner = [&](std::size_t k) {
        const int index = shape.mesh.indices[first + k].vertex_index;
        return index < 0 ? std::numeric_limits<std::uint32_t>::max() : static_cast<std::uint32_t>(index);
      };
      for (std::size_t k = 2; k < corners; ++k)
        mesh.indices.insert(mesh.indices.end(), {corner(0), corner(k - 1), corner(k)});
      first += corners;
    }
  }
  check_mesh(mesh, name);
  return mesh;
}

}  // namespace trisoup::soup
