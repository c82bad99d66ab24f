#include "render/gpu_model.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>
#include <vector>

#include "args/soup.h"
#include "soup/atlas.h"

namespace trisoup::render {
namespace {

using kernels::kPlacesWidth;

struct Record {
  std::uint32_t place = 0, layer_level = 0;
};

Record record_of(const soup::AtlasPlace& place) {
  return {place.x0 | std::uint32_t(place.y0) << 16,
          place.level | std::uint32_t(place.page) << 8 | std::uint32_t(place.turned) << 16};
}

/// Opacity between lattice points is a mixture of theirs, so the extremes are at the points.
std::pair<std::uint8_t, std::uint8_t> opacity_range(const soup::Model& model, const soup::TextureEntry& row) {
  std::uint8_t low = 255, high = 0;
  for (std::uint32_t i = 0; i < soup::samples_at(row.level_max); ++i) {
    const std::uint8_t value = model.lattice[(std::size_t(row.lattice_offset) + i) * soup::kChannels + 7];
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return {low, high};
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
  m.low = glm::vec3(std::numeric_limits<float>::max());
  m.high = -m.low;
  for (const glm::vec3& v : vertices) {
    m.low = glm::min(m.low, v);
    m.high = glm::max(m.high, v);
  }
  m.vertices = gpu.allocate(vertices.size() * sizeof(glm::vec3), "vertices");
  gpu.upload(m.vertices.address(), vertices);

  std::vector<std::uint32_t> levels;
  for (const soup::TextureEntry& row : model.textures) levels.push_back(row.level_max);
  const soup::Atlas atlas =
      soup::make_atlas(levels, std::min<int>(soup::kAtlasSide, static_cast<int>(graphics.max_side())));

  // A byte is at least a half from 128 on: 127.5 / 255 is the threshold.
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
  for (const std::uint32_t t : order) {
    const Record r = record_of(atlas.places[t]);
    const auto v = [&](int k) { return glm::vec4(vertices[3 * t + k], 0.0f); };
    corners.insert(corners.end(), 3, {v(0), v(1), v(2), r.place, r.layer_level, t + 1, 0});
  }
  m.corners = gpu.allocate(corners.size() * sizeof(kernels::SoupVertex), "triangles");
  gpu.upload(m.corners.address(), corners);

  std::vector<float> mlp = model.mlp.parameters;
  if (mlp_use == MlpUse::compiled)
    for (const float w : mlp) m.mlp_constants.push_back(std::bit_cast<std::uint32_t>(w));
  mlp.resize((mlp.size() + 3) / 4 * 4);
  m.mlp = gpu.allocate(mlp.size() * 4, "MLP");
  gpu.upload(m.mlp.address(), mlp);

  std::vector<Record> records;
  for (const soup::AtlasPlace& place : atlas.places) records.push_back(record_of(place));
  const std::uint32_t rows = (m.triangles + kPlacesWidth - 1) / kPlacesWidth;
  records.resize(std::size_t(rows) * kPlacesWidth);
  m.places = graphics.create_image({gpu::Format::rg32_uint, kPlacesWidth, std::max(1u, rows)}, "texture table");
  graphics.upload(m.places, 0, std::as_bytes(std::span(records)));

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
        const std::uint8_t* sample = &model.lattice[(std::size_t(model.textures[t].lattice_offset) + index) * soup::kChannels];
        opacities[at] = sample[7];
        std::copy_n(sample, 4, &low[4 * at]);
        std::copy_n(sample + 4, 4, &high[4 * at]);
      });
    }
    graphics.upload(m.opacities, page, std::as_bytes(std::span(opacities)));
    graphics.upload(m.features, 2 * page, std::as_bytes(std::span(low)));
    graphics.upload(m.features, 2 * page + 1, std::as_bytes(std::span(high)));
  }
  return m;
}

}  // namespace trisoup::render
