// Reads glTF 2.0 with tinygltf.
#include <cmath>
#include <cstring>
#include <limits>

// The library already contains tinygltf's implementation. Images are not decoded here, so stb is not needed.
#define TINYGLTF_NO_INCLUDE_STB_IMAGE
#define TINYGLTF_NO_INCLUDE_STB_IMAGE_WRITE
#include <tiny_gltf.h>

#include <glm/gtc/matrix_transform.hpp>

#include "base/error.h"
#include "mesh/mesh.h"

namespace trisoup::soup {
namespace {

std::string first_line(const std::string& text) {
  std::string line = text.substr(0, std::min<std::size_t>(text.find('\n'), 120));
  for (char& c : line)
    if (c < ' ' || c > '~') c = '?';
  return line;
}

class Reader {
 public:
  Reader(const tinygltf::Model& model, const std::string& name)
      : model_(model), name_(name), visited_(model.nodes.size(), false) {}

  Mesh read() {
    if (model_.scenes.empty()) {
      // A file without scenes is a library of parts. Read all of them, starting at the root nodes.
      std::vector<bool> is_child(model_.nodes.size(), false);
      for (const tinygltf::Node& node : model_.nodes)
        for (const int child : node.children) is_child[checked(child, model_.nodes.size(), "node")] = true;
      for (std::size_t node = 0; node < model_.nodes.size(); ++node)
        if (!is_child[node]) add_tree(static_cast<int>(node));
    } else {
      const std::size_t scene = checked(std::max(model_.defaultScene, 0), model_.scenes.size(), "scene");
      for (const int node : model_.scenes[scene].nodes) add_tree(node);
    }
    check_mesh(mesh_, name_);
    return std::move(mesh_);
  }

 private:
  std::size_t checked(int index, std::size_t size, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= size)
      throw Error("{}: uses {} {} of {}; export the mesh again", name_, what, index, size);
    return static_cast<std::size_t>(index);
  }

  static glm::dmat4 transform_of(const tinygltf::Node& node) {
    glm::dmat4 m(1.0);
    if (node.matrix.size() == 16) {
      for (int k = 0; k < 16; ++k) m[k / 4][k % 4] = node.matrix[static_cast<std::size_t>(k)];
      return m;
    }
    if (node.rotation.size() == 4) {
      const double x = node.rotation[0], y = node.rotation[1], z = node.rotation[2], w = node.rotation[3];
      m[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0};
      m[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0};
      m[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0};
    }
    if (node.scale.size() == 3)
      for (int k = 0; k < 3; ++k) m[k] *= node.scale[static_cast<std::size_t>(k)];
    if (node.translation.size() == 3) m[3] = {node.translation[0], node.translation[1], node.translation[2], 1};
    return m;
  }

  // Uses an explicit stack instead of recursion, so that deeply nested files cannot overflow the call stack.
  void add_tree(int root) {
    std::vector<std::pair<int, glm::dmat4>> open{{root, glm::dmat4(1.0)}};
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const std::size_t k = checked(index, model_.nodes.size(), "node");
      if (visited_[k]) throw Error("{}: node {} has two parents; export the mesh again", name_, index);
      visited_[k] = true;
      const tinygltf::Node& node = model_.nodes[k];
      glm::dmat4 world = parent * transform_of(node);
      // trisoup models have a root rotation that turns them up to +Y for viewers. Undo it to get dataset coordinates.
      if (model_.extensions.contains("TRISOUP_neural_textures"))
        world = glm::translate(glm::dmat4(1.0), glm::inverse(glm::dmat3(world)) * glm::dvec3(world[3]));
      if (node.mesh >= 0)
        for (const tinygltf::Primitive& primitive :
             model_.meshes[checked(node.mesh, model_.meshes.size(), "mesh")].primitives)
          add(primitive, world);
      for (const int child : node.children) open.emplace_back(child, world);
    }
  }

  struct Elements {
    const unsigned char* first;
    std::size_t stride, count;
  };

  // Returns the bytes of an accessor, checked against its buffer view and buffer.
  Elements elements_of(const tinygltf::Accessor& accessor, std::size_t element_size) const {
    if (accessor.sparse.isSparse || accessor.bufferView < 0)
      throw Error("{}: uses sparse or compressed arrays; export the mesh without compression", name_);
    const tinygltf::BufferView& view =
        model_.bufferViews[checked(accessor.bufferView, model_.bufferViews.size(), "buffer view")];
    const tinygltf::Buffer& buffer = model_.buffers[checked(view.buffer, model_.buffers.size(), "buffer")];
    const std::size_t stride = view.byteStride != 0 ? view.byteStride : element_size;
    const bool view_fits =
        view.byteOffset <= buffer.data.size() && view.byteLength <= buffer.data.size() - view.byteOffset;
    const bool fits = view_fits && accessor.byteOffset <= view.byteLength &&
                      (accessor.count == 0 ||
                       (element_size <= view.byteLength - accessor.byteOffset &&
                        (accessor.count - 1) <= (view.byteLength - accessor.byteOffset - element_size) / stride));
    if (!fits) throw Error("{}: an array lies outside its buffer; copy or export the file again", name_);
    if (accessor.count == 0) return {nullptr, stride, 0};
    return {buffer.data.data() + view.byteOffset + accessor.byteOffset, stride, accessor.count};
  }

  template <typename T>
  static T load(const Elements& elements, std::size_t k, std::size_t component = 0) {
    T value;
    std::memcpy(&value, elements.first + k * elements.stride + component * sizeof(T), sizeof value);
    return value;
  }

  void add(const tinygltf::Primitive& primitive, const glm::dmat4& world) {
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode != TINYGLTF_MODE_TRIANGLES && mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN)
      return;
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) return;
    const tinygltf::Accessor& points = model_.accessors[checked(position->second, model_.accessors.size(), "accessor")];
    if (points.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT || points.type != TINYGLTF_TYPE_VEC3)
      throw Error("{}: positions are not 32-bit floats; export the mesh without quantisation", name_);

    const Elements coordinates = elements_of(points, 3 * sizeof(float));
    const std::size_t base = mesh_.positions.size();
    if (base + coordinates.count > std::numeric_limits<std::uint32_t>::max())
      throw Error("{}: has more than 2^32 vertices; decimate the mesh first", name_);
    for (std::size_t k = 0; k < coordinates.count; ++k)
      mesh_.positions.emplace_back(world * glm::dvec4(load<float>(coordinates, k, 0), load<float>(coordinates, k, 1),
                                                      load<float>(coordinates, k, 2), 1.0));

    std::vector<std::uint32_t> corners;
    if (primitive.indices < 0) {
      for (std::size_t k = 0; k < coordinates.count; ++k) corners.push_back(static_cast<std::uint32_t>(k));
    } else {
      const tinygltf::Accessor& accessor =
          model_.accessors[checked(primitive.indices, model_.accessors.size(), "accessor")];
      const int type = accessor.componentType;
      const std::size_t size = type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? 1
                               : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? 2
                               : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT   ? 4
                                                                                : 0;
      if (size == 0 || accessor.type != TINYGLTF_TYPE_SCALAR)
        throw Error("{}: indices are not unsigned integers; export the mesh again", name_);
      const Elements indices = elements_of(accessor, size);
      for (std::size_t k = 0; k < indices.count; ++k)
        corners.push_back(size == 1   ? load<std::uint8_t>(indices, k)
                          : size == 2 ? load<std::uint16_t>(indices, k)
                                      : load<std::uint32_t>(indices, k));
    }
    for (const std::uint32_t corner : corners)
      if (corner >= coordinates.count)
        throw Error("{}: a triangle uses vertex {} of {}; export the mesh again", name_, corner, coordinates.count);

    const auto triangle = [&](std::size_t a, std::size_t b, std::size_t c) {
      for (const std::size_t k : {a, b, c}) mesh_.indices.push_back(static_cast<std::uint32_t>(base + corners[k]));
    };
    if (mode == TINYGLTF_MODE_TRIANGLES)
      for (std::size_t k = 0; k + 2 < corners.size(); k += 3) triangle(k, k + 1, k + 2);
    else
      for (std::size_t k = 2; k < corners.size(); ++k) {
        if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
          triangle(0, k - 1, k);
        else if (k % 2 == 0)
          triangle(k - 2, k - 1, k);
        else
          triangle(k - 1, k - 2, k);  // every other triangle of a strip has reversed winding
      }
  }

  const tinygltf::Model& model_;
  const std::string& name_;
  std::vector<bool> visited_;
  Mesh mesh_;
};

// Textures are not used here, so a missing or unreadable image must not prevent reading the mesh.
bool ignore_image(tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
  return true;
}

}  // namespace

Mesh read_gltf(std::span<const std::byte> bytes, const std::filesystem::path& folder, const std::string& name) {
  if (bytes.size() > std::numeric_limits<unsigned>::max())
    throw Error("{}: is larger than 4 GiB; decimate the mesh first", name);
  const auto size = static_cast<unsigned>(bytes.size());
  const bool binary = size >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;

  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(ignore_image, nullptr);
  tinygltf::Model model;
  std::string errors, warnings;
  bool loaded = false;
  try {
    loaded = binary ? loader.LoadBinaryFromMemory(&model, &errors, &warnings,
                                                  reinterpret_cast<const unsigned char*>(bytes.data()), size,
                                                  folder.string())
                    : loader.LoadASCIIFromString(&model, &errors, &warnings,
                                                 reinterpret_cast<const char*>(bytes.data()), size, folder.string());
  } catch (const std::exception& exception) {  // tinygltf's JSON accessors throw on numbers of the wrong type
    errors = exception.what();
  }
  if (!loaded) throw Error("{}: is damaged ({}); export the mesh again", name, first_line(errors));
  return Reader(model, name).read();
}

}  // namespace trisoup::soup
