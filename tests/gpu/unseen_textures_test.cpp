// Tests engine/train/topology/unseen_textures.h on a device.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "train/step/photographs.h"
#include "train/topology/unseen_textures.h"

using namespace trisoup;
using test::SmallScene;

namespace {

/// Views with photographs of which the lower half is masked.
struct MaskedViews {
  explicit MaskedViews(gpu::Device& gpu) : views{test::view_from(0.4, 61, 47), test::view_from(2.5, 40, 40)} {
    for (const train::BatchView& view : views) {
      Image image{static_cast<int>(view.width), static_cast<int>(view.height), {}};
      for (std::uint32_t i = 0; i < 4 * view.width * view.height; ++i)
        image.rgba.push_back(i % 4 == 3 && i > 2 * view.width * view.height ? 0 : 255);
      images.push_back(image);
    }
    photographs = train::upload_photographs(gpu, images);
    for (std::uint32_t v = 0; v < 2; ++v) views[v].photo = photographs.addresses[v], views[v].index = v;
  }
  std::vector<train::BatchView> views;
  std::vector<Image> images;
  train::Photographs photographs;
};

/// Whether a pixel shows each lattice sample, by the hits of all views.
std::vector<bool> shown(SmallScene& s, const MaskedViews& masked) {
  std::vector<bool> seen(s.soup.lattice_samples);
  train::for_each_batch(s.gpu, s.soup, s.buffers, masked.views, false, {}, 1, [&](std::size_t view, std::size_t) {
    const auto hits = s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels);
    for (std::size_t p = 0; p < hits.size(); ++p) {
      if (hits[p].triangle == 0 || masked.images[view].rgba[4 * p + 3] < 128) continue;
      const soup::TextureEntry& row = s.soup.table[hits[p].triangle - 1];
      const f32::LatticeCell cell = f32::lattice_cell(hits[p].b0, hits[p].b1, row.level_max);
      for (const auto& [i, w] : {std::pair(cell.i0, cell.w0), {cell.i1, cell.w1}, {cell.i2, cell.w2}})
        if (w > 1e-6f) seen[row.lattice_offset + i] = true;
    }
  });
  return seen;
}

}  // namespace

TEST_CASE("texture samples that no photograph shows become means of the seen ones", "[unseen]") {
  auto gpu = test::open_device();
  const MaskedViews masked(*gpu);
  SmallScene s(*gpu, 14, {{0, 0}, {2, 3}, {1, 4}, {2, 5}, {2, 2}}, masked.views);
  const std::vector<bool> seen = shown(s, masked);
  const auto count = std::count(seen.begin(), seen.end(), true);
  REQUIRE(count > 200);
  REQUIRE(count < std::ptrdiff_t(seen.size()) - 300);
  const std::uint64_t values = 8 * s.soup.lattice_samples;
  const auto before = gpu->download_vector<float>(s.soup.lattice.address(), values);
  const auto source = gpu->download_vector<float>(s.soup.source.address(), s.logits.size());
  const auto vertices = gpu->download_vector<glm::vec3>(s.soup.vertices.address(), 3ull * s.soup.triangles);
  const std::vector<float> expected =
      train::fill_unseen(vertices, s.soup.table, before, std::vector<float>(seen.begin(), seen.end()));

  train::fill_unseen(*gpu, s.soup, s.buffers, masked.views);
  const auto after = gpu->download_vector<float>(s.soup.lattice.address(), values);
  const auto source_after = gpu->download_vector<float>(s.soup.source.address(), s.logits.size());
  float least = 1, most = 0, worst = 0, kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i)
    for (std::size_t k = 8 * i; k < 8 * i + 8; ++k) {
      if (seen[i]) least = std::min(least, before[k]), most = std::max(most, before[k]);
      if (seen[i] || k % 8 == 7)
        kept = std::max(kept, std::abs(after[k] - before[k]));
      else
        worst = std::max(worst, std::abs(after[k] - expected[k]));
    }
  CHECK(kept == 0);
  CHECK(worst < 1e-4f);
  // Coarser levels stay, so what is seen does not change where they are read at other places.
  for (std::uint32_t t = 0; t < s.soup.triangles; ++t) {
    const soup::TextureEntry& row = s.soup.table[t];
    for (std::size_t k = 8 * row.source_offset;
         k < 8 * (row.source_offset + soup::samples_in(row.level_min, row.level_max) - soup::samples_at(row.level_max));
         ++k)
      REQUIRE(source_after[k] == source[k]);
  }
  // Random textures: a mean is nearer to the middle than they are.
  double spread_before = 0, spread_after = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) continue;
    CHECK((after[8 * i] > least && after[8 * i] < most));
    spread_before += std::abs(before[8 * i] - 0.5), spread_after += std::abs(after[8 * i] - 0.5);
  }
  CHECK(spread_after < 0.8 * spread_before);
  test::require_silence(*gpu);
}

TEST_CASE("textures stay as they are where no photograph shows anything", "[unseen]") {
  auto gpu = test::open_device();
  const MaskedViews masked(*gpu);
  SmallScene s(*gpu, 3, {{2, 3}}, masked.views);
  gpu->upload(s.soup.vertices.address(), std::vector<glm::vec3>(9, glm::vec3(0, 0, 50)));
  train::fill_unseen(*gpu, s.soup, s.buffers, masked.views);
  const auto after = gpu->download_vector<float>(s.soup.source.address(), s.logits.size());
  float worst = 0;
  for (std::size_t i = 0; i < after.size(); ++i) worst = std::max(worst, std::abs(after[i] - s.logits[i]));
  CHECK(worst < 1e-5f);
  test::require_silence(*gpu);
}
