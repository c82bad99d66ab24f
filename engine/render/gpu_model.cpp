#include "render/gpu_model.h"

#include <algorithm>
#include <bit>
#include <span>
#include <vector>

#include "args/soup.h"
#include "soup/atlas.h"

namespace trisoup::render {
namespace {

using kernels::kTableWidth;

glm::uvec3 bits(const glm::vec3& v) {
  return {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y), std::bit_cast<std::uint32_t>(v.z)};
}

/// Returns the smallest and largest opacity of a triangle. Opacity is interpolated between lattice points, so the
/// extremes are at lattice points.
std::pair<std::uint8_t, std::uint8_t> opacity_range(const soup::Model& model, const soup::TextureEntry& row) {
  std::uint8_t low = 255, high = 0;
  for (std::uint32_t i = 0; i < soup::samples_at(row.level_max); ++i) {
    const std::uint8_t value = model.lattice[(std::size_t(row.lattice_offset) + i) * soup::kChannels + 7];
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return {low, high};
}

/// Uploads the corners of the triangles that can be visible, opaque triangles first.
void upload_corners(gpu::Device& gpu, const soup::Model& model, const std::vector<glm::vec3>& vertices, GpuModel& m) {
  // Bytes of 128 or more are opaque: the threshold 0.5 is 127.5 / 255.
  std::vector<std::uint32_t> order, masked;
  for (std::uint32_t t = 0; t < m.triangles; ++t) {
    const auto [low, high] = opacity_range(model, model.textures[t]);
    if (low >= 128)
      order.push_back(t);
    else if (high >= 128)
      masked.push_back(t);
  }
  m.opaque = static_cast<std::uint32_t>(order.size());
  m.masked = static_cast<std::uint32_t>(masked.size());
  order.insert(order.end(), masked.begin(), masked.end());
  std::vector<kernels::SoupVertex> corners;
  corners.reserve(3 * order.size());
  for (const std::uint32_t t : order)
    for (int k = 0; k < 3; ++k) {
      const glm::uvec3 v = bits(vertices[3 * t + k]);
      corners.push_back({v.x, v.y, v.z, t + 1});
    }
  m.corners = gpu.allocate(corners.size() * sizeof(kernels::SoupVertex), "triangles");
  gpu.upload(m.corners.address(), corners);
}

/// Uploads edges and atlas positions, three texels per triangle.
void upload_table(gpu::Graphics& graphics, const std::vector<glm::vec3>& vertices, const soup::Atlas& atlas,
                  GpuModel& m) {
  const std::uint32_t rows = std::max(1u, (m.triangles + kTableWidth - 1) / kTableWidth);
  m.table = graphics.create_image({gpu::Format::rgba32_uint, kTableWidth, rows, 3}, "table of triangles");
  for (std::uint32_t layer = 0; layer < 3; ++layer) {
    std::vector<glm::uvec4> texels(std::size_t(rows) * kTableWidth);
    for (std::uint32_t t = 0; t < m.triangles; ++t) {
      const glm::vec3 &v0 = vertices[3 * t], &v1 = vertices[3 * t + 1], &v2 = vertices[3 * t + 2];
      const soup::AtlasPlace& place = atlas.places[t];
      if (layer == 0) texels[t] = glm::uvec4(bits(v2), place.x0 | std::uint32_t(place.y0) << 16);
      if (layer == 1)
        texels[t] =
            glm::uvec4(bits(v0 - v2), place.level | std::uint32_t(place.page) << 8 | std::uint32_t(place.turned) << 16);
      if (layer == 2) texels[t] = glm::uvec4(bits(v1 - v2), 0);
    }
    graphics.upload(m.table, layer, std::as_bytes(std::span(texels)));
  }
}

void upload_textures(gpu::Graphics& graphics, const soup::Model& model, const soup::Atlas& atlas, GpuModel& m) {
  std::uint32_t width = 0, height = 0;
  for (const glm::ivec2& page : atlas.pages) {
    width = std::max(width, static_cast<std::uint32_t>(page.x));
    height = std::max(height, static_cast<std::uint32_t>(page.y));
  }
  const auto pages = static_cast<std::uint32_t>(atlas.pages.size());
  m.opacities = graphics.create_image({gpu::Format::r8, width, height, pages}, "opacities");
  m.features = graphics.create_image({gpu::Format::rgba8, width, height, 2 * pages}, "features");
  std::vector<std::uint8_t> opacities(std::size_t(width) * height), low(4 * opacities.size()), high(low.size());
  for (std::uint32_t page = 0; page < pages; ++page) {
    for (std::uint32_t t = 0; t < m.triangles; ++t) {
      const soup::AtlasPlace& place = atlas.places[t];
      if (place.page != page) continue;
      soup::each_lattice_point(place.level, [&](int x, int y, std::uint32_t index) {
        const glm::ivec2 texel = soup::atlas_texel(place, x, y);
        const std::size_t at = std::size_t(texel.y) * width + texel.x;
        const std::uint8_t* sample =
            &model.lattice[(std::size_t(model.textures[t].lattice_offset) + index) * soup::kChannels];
        opacities[at] = sample[7];
        std::copy_n(sample, 4, &low[4 * at]);
        std::copy_n(sample + 4, 4, &high[4 * at]);
      });
    }
    graphics.upload(m.opacities, page, std::as_bytes(std::span(opacities)));
    graphics.upload(m.features, 2 * page, std::as_bytes(std::span(low)));
    graphics.upload(m.features, 2 * page + 1, std::as_bytes(std::span(high)));
  }
}

}  // namespace

GpuModel upload_model(gpu::Device& gpu, const soup::Model& model, MlpUse mlp_use) {
  gpu::Graphics& graphics = gpu::graphics_of(gpu);
  GpuModel m;
  m.triangles = static_cast<std::uint32_t>(model.triangles());
  m.background = model.background;
  m.centre = model.centre;
  m.scale = model.scale;

  const std::vector<glm::vec3> vertices = soup::normalised_vertices(model);
  m.box = soup::inner_box(vertices, 0.01);

  std::vector<std::uint32_t> levels;
  for (const soup::TextureEntry& row : model.textures) levels.push_back(row.level_max);
  const soup::Atlas atlas =
      soup::make_atlas(levels, std::min<int>(soup::kAtlasSide, static_cast<int>(graphics.max_side())));

  upload_corners(gpu, model, vertices, m);

  std::vector<float> mlp = model.mlp.parameters;
  if (mlp_use == MlpUse::compiled)
    for (const float w : mlp) m.mlp_constants.push_back(std::bit_cast<std::uint32_t>(w));
  mlp.resize((mlp.size() + 3) / 4 * 4);
  m.mlp = gpu.allocate(mlp.size() * 4, "MLP");
  gpu.upload(m.mlp.address(), mlp);

  upload_table(graphics, vertices, atlas, m);
  upload_textures(graphics, model, atlas, m);
  return m;
}

}  // namespace trisoup::render
