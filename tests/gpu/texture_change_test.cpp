// Tests the conversion of textures when levels or triangles change: shaders/upsample_textures.comp and
// shaders/inherit_textures.comp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "args/inherit_textures.h"
#include "args/quantise.h"
#include "args/upsample_textures.h"
#include "common/host.h"
#include "gpu/small_scene.h"
#include "soup/atlas.h"
#include "soup/subdivision.h"

using namespace trisoup;

namespace {

struct Pool {
  Pool(gpu::Device& gpu, const std::vector<soup::TextureLevels>& levels, soup::Random& random)
      : table(soup::make_texture_table(levels)),
        rows(gpu.allocate(table.entries.size() * sizeof(soup::TextureEntry), "table")),
        source(gpu.allocate(table.source_samples * 32, "logits")),
        logits(table.source_samples * 8) {
    gpu.upload(rows.address(), table.entries);
    for (float& v : logits) v = random.uniform(-2, 2);
    gpu.upload(source.address(), logits);
  }
  soup::TextureTable table;
  gpu::Buffer rows, source;
  std::vector<float> logits;
};

gpu::Buffer upload_corners(gpu::Device& gpu, const std::vector<soup::Corners>& corners) {
  std::vector<glm::vec2> barycentrics;
  for (const soup::Corners& triangle : corners)
    for (const glm::vec3& corner : triangle) barycentrics.emplace_back(corner);
  gpu::Buffer buffer = gpu.allocate(barycentrics.size() * sizeof(glm::vec2), "corners");
  gpu.upload(buffer.address(), barycentrics);
  return buffer;
}

/// Returns the sum over the levels of a texture at barycentrics (b0, b1), channel c.
double sum_of_levels(const soup::TextureEntry& row, const std::vector<float>& logits, double b0, double b1, int c) {
  double sum = 0;
  std::uint32_t base = row.source_offset;
  for (std::uint32_t l = row.level_min; l <= row.level_max; ++l) {
    const f64::LatticeCell cell = f64::lattice_cell(b0, b1, l);
    const auto logit = [&](std::uint32_t i) { return double(logits[(base + i) * 8 + c]); };
    sum += cell.w0 * logit(cell.i0) + cell.w1 * logit(cell.i1) + cell.w2 * logit(cell.i2);
    base += soup::samples_at(l);
  }
  return sum;
}

}  // namespace

TEST_CASE("the change from coarse to fine keeps textures at the coarsest new level, for any levels",
          "[textures][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(21);
  const std::vector<soup::TextureLevels> before{{0, 0}, {0, 2}, {1, 1}, {2, 5}, {0, 5}, {3, 3}};
  const std::vector<soup::TextureLevels> after{{2, 5}, {2, 5}, {0, 3}, {1, 2}, {5, 5}, {4, 5}};
  Pool old_pool(*gpu, before, random);
  const auto triangles = static_cast<std::uint32_t>(before.size());
  for (const std::uint32_t keep_opacity : {0u, 1u}) {
    CAPTURE(keep_opacity);
    Pool new_pool(*gpu, after, random);  // all old values are overwritten
    gpu->launch(
        {"upsample_textures"}, triangles,
        kernels::UpsampleTexturesArgs{old_pool.rows.address(), new_pool.rows.address(), old_pool.source.address(),
                                      new_pool.source.address(), triangles, keep_opacity});
    const auto actual = gpu->download_vector<float>(new_pool.source.address(), new_pool.table.source_samples * 8);
    double worst = 0;
    for (std::uint32_t t = 0; t < triangles; ++t) {
      const soup::TextureEntry &from = old_pool.table.entries[t], &to = new_pool.table.entries[t];
      const double side = 1u << to.level_min;
      for (std::uint32_t s = 0; s < soup::samples_in(to.level_min, to.level_max); ++s)
        for (int c = 0; c < 8; ++c) {
          double expected = 0;
          if (s < soup::samples_at(to.level_min) && (c < 7 || keep_opacity)) {
            std::uint32_t x = 0, y = 0, base = from.source_offset;
            f64::lattice_point(s, x, y);
            for (std::uint32_t l = from.level_min; l <= from.level_max; ++l) {
              const f64::LatticeCell cell = f64::lattice_cell(x / side, y / side, l);
              const auto logit = [&](std::uint32_t i) { return double(old_pool.logits[(base + i) * 8 + c]); };
              expected += cell.w0 * logit(cell.i0) + cell.w1 * logit(cell.i1) + cell.w2 * logit(cell.i2);
              base += soup::samples_at(l);
            }
          }
          worst = std::max(worst, std::abs(expected - actual[(std::size_t(to.source_offset) + s) * 8 + c]));
        }
    }
    CHECK(worst < 3e-6);
  }
  test::require_silence(*gpu);
}

TEST_CASE("unsplit triangles and copies inherit all levels of the parent exactly", "[textures]") {
  auto gpu = test::open_device();
  soup::Random random(22);
  const std::vector<soup::TextureLevels> parent_levels{{2, 5}, {0, 0}, {1, 3}, {0, 5}};
  Pool old_pool(*gpu, parent_levels, random);
  std::vector<std::uint32_t> parents{3, 0, 0, 2, 1, 1, 3};  // another order, some parents twice, none dropped
  std::vector<soup::TextureLevels> levels;
  for (const std::uint32_t p : parents) levels.push_back(parent_levels[p]);
  Pool new_pool(*gpu, levels, random);
  const gpu::Buffer map = gpu->allocate(parents.size() * 4, "parents");
  gpu->upload(map.address(), parents);
  const auto triangles = static_cast<std::uint32_t>(parents.size());
  const std::vector<soup::Corners> corners(triangles, soup::kWholeParent);
  const gpu::Buffer whole = upload_corners(*gpu, corners);
  const std::uint32_t copy = GENERATE(0u, 1u);
  gpu->launch({"inherit_textures"}, triangles,
              kernels::InheritTexturesArgs{map.address(), copy ? 0 : whole.address(), old_pool.rows.address(),
                                           new_pool.rows.address(), old_pool.source.address(),
                                           new_pool.source.address(), triangles, copy});
  std::vector<float> expected;
  for (const std::uint32_t p : parents) {
    const soup::TextureEntry& row = old_pool.table.entries[p];
    const auto first = old_pool.logits.begin() + std::ptrdiff_t(8) * row.source_offset;
    expected.insert(expected.end(), first, first + std::ptrdiff_t(8) * soup::samples_in(row.level_min, row.level_max));
  }
  CHECK(gpu->download_vector<float>(new_pool.source.address(), new_pool.table.source_samples * 8) == expected);
  test::require_silence(*gpu);
}

TEST_CASE("halves of a split triangle look like their part of the parent", "[textures][each_driver]") {
  auto gpu = test::open_device();
  soup::Random random(23);
  const std::vector<soup::TextureLevels> parent_levels{{2, 5}, {0, 0}, {1, 3}, {0, 5}};
  Pool old_pool(*gpu, parent_levels, random);
  std::vector<glm::vec3> vertices;
  for (std::size_t i = 0; i < 3 * parent_levels.size(); ++i)
    vertices.push_back(glm::vec3{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  const soup::Subdivision split = soup::bisect_longest(vertices, 20);
  std::vector<soup::TextureLevels> levels;
  for (const std::uint32_t p : split.face_map) levels.push_back(parent_levels[p]);
  const bool finer = GENERATE(false, true);
  if (finer)
    for (std::size_t t = 0; t < levels.size(); t += 2)
      levels[t] = {0, 4};  // levels may differ from those of the parent
  Pool new_pool(*gpu, levels, random);
  const gpu::Buffer map = gpu->allocate(split.triangles() * 4, "parents"),
                    corners = upload_corners(*gpu, split.corners);
  gpu->upload(map.address(), split.face_map);
  const auto triangles = static_cast<std::uint32_t>(split.triangles());
  gpu->launch(
      {"inherit_textures"}, triangles,
      kernels::InheritTexturesArgs{map.address(), corners.address(), old_pool.rows.address(), new_pool.rows.address(),
                                   old_pool.source.address(), new_pool.source.address(), triangles, 0});
  const auto actual = gpu->download_vector<float>(new_pool.source.address(), new_pool.table.source_samples * 8);
  double worst = 0, coarse = 0;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const soup::TextureEntry &from = old_pool.table.entries[split.face_map[t]], &to = new_pool.table.entries[t];
    const double side = 1u << to.level_max;
    for (std::uint32_t s = 0; s < soup::samples_at(to.level_max); ++s) {
      std::uint32_t x = 0, y = 0;
      f64::lattice_point(s, x, y);
      const double own[3] = {x / side, y / side, 1 - (x + y) / side};
      glm::dvec3 b(0);
      for (int k = 0; k < 3; ++k) b += own[k] * glm::dvec3(split.corners[t][k]);
      for (int c = 0; c < 8; ++c)
        worst = std::max(worst, std::abs(sum_of_levels(to, actual, own[0], own[1], c) -
                                         sum_of_levels(from, old_pool.logits, b.x, b.y, c)));
    }
    // The coarsest level must match the parent at its own points, so that the finest level does not replace the others.
    if (to.level_min == from.level_min && to.level_min < to.level_max)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const soup::TextureEntry first{from.source_offset, 0, from.level_min, from.level_min};
        const std::uint32_t r = 1u << to.level_min, at = f64::lattice_index(k == 0 ? r : 0, k == 1 ? r : 0);
        coarse = std::max(
            coarse, std::abs(actual[(std::size_t(to.source_offset) + at) * 8] -
                             sum_of_levels(first, old_pool.logits, split.corners[t][k].x, split.corners[t][k].y, 0)));
      }
  }
  CHECK(worst < 1e-5);
  CHECK(coarse < 1e-5);
  test::require_silence(*gpu);
}

TEST_CASE("8-bit textures are rounded to the nearest value", "[textures][each_driver]") {
  auto gpu = test::open_device();
  std::vector<float> values{0.0f, 1.0f, -0.0f,           -1.0f,
                            1.5f, NAN,  127.5f / 255.0f, std::nextafter(127.5f / 255.0f, 0.0f)};
  // Values around the middle between two bytes. Just below it, adding 0.5 and truncating would round up.
  for (int k = 0; k < 255; ++k)
    for (float v = (static_cast<float>(k) + 0.5f) / 255.0f, i = 0; i < 8;
         ++i, v = std::nextafter(v, i < 4 ? 0.0f : 1.0f))
      values.push_back(v);
  values.resize(values.size() / 8 * 8);
  const auto samples = static_cast<std::uint32_t>(values.size() / 8);
  const gpu::Buffer lattice = gpu->allocate(values.size() * 4, "lattice"),
                    packed = gpu->allocate(values.size(), "bytes");
  gpu->upload(lattice.address(), values);
  gpu->launch({"quantise"}, (samples + 63) / 64,
              kernels::QuantiseArgs{lattice.address(), packed.address(), samples, 0});
  const auto bytes = gpu->download_vector<std::uint8_t>(packed.address(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    CAPTURE(values[i]);
    CHECK(bytes[i] == (values[i] >= 0 ? std::lround(std::min(values[i], 1.0f) * 255.0f) : 0));
  }
  test::require_silence(*gpu);
}
