#include "format/collider.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <unordered_map>

#include <glm/glm.hpp>

#include "base/error.h"
#include "common/host.h"
#include "format/glb.h"
#include "mesh/decimate.h"
#include "mesh/inner_box.h"

namespace trisoup::soup {
namespace {

constexpr double kLeftOut = 0.05;   // fraction of the vertices beyond each end of the box
constexpr float kAround = 0.25f;    // the box grows by this fraction of its sides
constexpr std::size_t kSpeck = 10;  // cells; smaller groups are not obstacles

/// Cells of a regular grid that the soup passes through.
class Grid {
 public:
  Grid(const Box& box, int longest_side) : low_(box.low) {
    const glm::vec3 size = box.high - box.low;
    cell_ = std::max({size.x, size.y, size.z}) / static_cast<float>(longest_side);
    // Adds a layer of empty cells on all sides.
    for (int axis = 0; axis < 3; ++axis) sides_[axis] = static_cast<int>(size[axis] / cell_) + 3;
    low_ -= cell_;
    number_.assign(static_cast<std::size_t>(sides_.x) * sides_.y * sides_.z, -1);
  }

  float cell() const { return cell_; }
  glm::vec3 corner(const glm::ivec3& c) const { return low_ + cell_ * glm::vec3(c); }
  std::size_t at(const glm::ivec3& c) const {
    return (static_cast<std::size_t>(c.z) * sides_.y + c.y) * sides_.x + c.x;
  }
  bool has(const glm::ivec3& c) const { return number_[at(c)] >= 0; }
  const std::vector<glm::ivec3>& cells() const { return cells_; }
  /// Mean of the points in a cell. The cell must not be empty.
  glm::vec3 middle(const glm::ivec3& c) const { return glm::vec3(sums_[number_[at(c)]]) / sums_[number_[at(c)]].w; }

  void add(const glm::vec3& p) {
    const glm::vec3 place = (p - low_) / cell_;
    for (int axis = 0; axis < 3; ++axis)
      if (!(place[axis] >= 1 && place[axis] < static_cast<float>(sides_[axis] - 1))) return;
    const glm::ivec3 c(place);
    std::int32_t& number = number_[at(c)];
    if (number < 0) {
      number = static_cast<std::int32_t>(cells_.size());
      cells_.push_back(c);
      sums_.emplace_back(0.0f);
    }
    sums_[number] += glm::vec4(p, 1.0f);
  }

  /// Removes groups of touching cells with fewer than `min_cells` cells.
  void drop_specks(std::size_t min_cells) {
    std::vector<bool> seen(cells_.size(), false);
    std::vector<glm::ivec3> kept;
    for (const glm::ivec3& first : cells_) {
      if (seen[number_[at(first)]]) continue;
      seen[number_[at(first)]] = true;
      std::vector<glm::ivec3> group{first};
      for (std::size_t i = 0; i < group.size(); ++i)
        each_around(group[i], [&](const glm::ivec3& c) {
          if (!has(c) || seen[number_[at(c)]]) return;
          seen[number_[at(c)]] = true;
          group.push_back(c);
        });
      if (group.size() >= min_cells)
        kept.insert(kept.end(), group.begin(), group.end());
      else
        dropped_.insert(dropped_.end(), group.begin(), group.end());
    }
    for (const glm::ivec3& c : dropped_) number_[at(c)] = -1;
    cells_ = std::move(kept);
  }

 private:
  template <typename F>
  static void each_around(const glm::ivec3 c, F&& f) {
    for (int i = 0; i < 27; ++i) f(c + glm::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  }

  glm::vec3 low_;
  float cell_ = 1;
  glm::ivec3 sides_{0};
  std::vector<std::int32_t> number_;  // per cell: index into sums_, or -1 if the cell is empty
  std::vector<glm::ivec3> cells_, dropped_;
  std::vector<glm::vec4> sums_;  // sums of points; w: number of points
};

/// Adds the opaque points of a triangle, sampled at half a cell's distance.
void add_triangle(const Model& model, std::size_t t, int most_steps, Grid& grid) {
  const glm::vec3 *v = &model.vertices[3 * t], e0 = v[0] - v[2], e1 = v[1] - v[2];
  const float longest = std::max({glm::length(e0), glm::length(e1), glm::length(e0 - e1)});
  const int steps =
      static_cast<int>(std::clamp(std::ceil(2 * longest / grid.cell()), 1.0f, static_cast<float>(most_steps)));
  const TextureEntry& row = model.textures[t];
  const int r = 1 << row.level_max;
  for (int j = 0; j <= steps; ++j)
    for (int i = 0; i + j <= steps; ++i) {
      const float b0 = static_cast<float>(i) / steps, b1 = static_cast<float>(j) / steps;
      // The nearest lattice point, or its neighbour if it lies beyond the diagonal.
      const int x = static_cast<int>(std::lround(b0 * r)), y = std::min(static_cast<int>(std::lround(b1 * r)), r - x);
      const std::size_t sample = std::size_t(row.lattice_offset) + f32::lattice_index(x, y);
      if (model.lattice[sample * kChannels + 7] >= 128) grid.add(v[2] + b0 * e0 + b1 * e1);
    }
}

/// Returns the faces between occupied and empty cells, counter-clockwise as seen from outside.
Mesh hull(const Grid& grid) {
  Mesh mesh;
  std::unordered_map<std::size_t, std::uint32_t> known;
  const auto vertex = [&](const glm::ivec3& corner) {
    const auto [entry, is_new] = known.try_emplace(grid.at(corner), static_cast<std::uint32_t>(mesh.positions.size()));
    if (is_new) {
      glm::vec3 sum(0.0f);
      int count = 0;
      for (int i = 0; i < 8; ++i) {
        const glm::ivec3 c = corner - glm::ivec3(i & 1, i >> 1 & 1, i >> 2);
        if (!grid.has(c)) continue;
        sum += grid.middle(c);
        ++count;
      }
      mesh.positions.push_back(0.5f * (grid.corner(corner) + sum / static_cast<float>(count)));
    }
    return entry->second;
  };
  for (const glm::ivec3& c : grid.cells())
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        glm::ivec3 ahead(0), u(0), w(0);
        ahead[axis] = 1;
        u[(axis + 1) % 3] = 1;
        w[(axis + 2) % 3] = 1;
        if (grid.has(side ? c + ahead : c - ahead)) continue;
        const glm::ivec3 first = side ? c + ahead : c;
        std::array<std::uint32_t, 4> q{vertex(first), vertex(first + u), vertex(first + u + w), vertex(first + w)};
        if (!side) std::swap(q[1], q[3]);
        mesh.indices.insert(mesh.indices.end(), {q[0], q[1], q[2], q[0], q[2], q[3]});
      }
  return mesh;
}

}  // namespace

Mesh collision_mesh(const Model& model, std::size_t budget) {
  Box box = inner_box(model.vertices, kLeftOut);
  const glm::vec3 around = kAround * (box.high - box.low);
  box = {box.low - around, box.high + around};
  const int side = static_cast<int>(std::clamp(2 * std::sqrt(static_cast<double>(budget)), 32.0, 192.0));
  const glm::vec3 size = box.high - box.low;
  const Error empty("model: nothing is opaque, so there is no collider; train it longer");
  if (!(std::max({size.x, size.y, size.z}) > 0)) throw empty;
  Grid grid(box, side);
  for (std::size_t t = 0; t < model.triangles(); ++t) add_triangle(model, t, 4 * side, grid);
  grid.drop_specks(std::min(kSpeck, grid.cells().size()));
  if (grid.cells().empty()) throw empty;
  return decimate(hull(grid), budget);
}

std::vector<std::byte> encode_collider(const Mesh& mesh, const nlohmann::json& node) {
  using nlohmann::json;
  // glTF constants.
  constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
  const std::size_t position_bytes = mesh.positions.size() * sizeof(glm::vec3), index_bytes = mesh.indices.size() * 4;
  std::vector<std::byte> binary(position_bytes + index_bytes);
  std::memcpy(binary.data(), mesh.positions.data(), position_bytes);
  std::memcpy(binary.data() + position_bytes, mesh.indices.data(), index_bytes);
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  for (const glm::vec3& p : mesh.positions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  json place = {{"mesh", 0}, {"name", "collider"}};
  for (const char* key : {"matrix", "translation"})
    if (node.contains(key)) place[key] = node[key];
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "trisoup"}};
  gltf["scene"] = 0;
  gltf["scenes"] = json::array({json{{"nodes", json::array({0})}}});
  gltf["nodes"] = json::array({place});
  gltf["meshes"] = json::array(
      {json{{"name", "collider"},
            {"primitives", json::array({json{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"mode", 4}}})}}});
  gltf["accessors"] = json::array(
      {json{{"bufferView", 0},
            {"componentType", kFloat},
            {"count", mesh.positions.size()},
            {"type", "VEC3"},
            {"min", {low.x, low.y, low.z}},
            {"max", {high.x, high.y, high.z}}},
       json{{"bufferView", 1}, {"componentType", kUnsignedInt}, {"count", mesh.indices.size()}, {"type", "SCALAR"}}});
  gltf["bufferViews"] =
      json::array({json{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", position_bytes}, {"target", kArrayBuffer}},
                   json{{"buffer", 0},
                        {"byteOffset", position_bytes},
                        {"byteLength", index_bytes},
                        {"target", kElementArrayBuffer}}});
  gltf["buffers"] = json::array({json{{"byteLength", binary.size()}}});
  return encode_glb(gltf, binary, "collider");
}

}  // namespace trisoup::soup
