#include "train/start/painting.h"

#include <vector>

#include "args/sum_photographs.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {

FixedSums sum_photographs(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                          std::span<const soup::TextureEntry> table, TriangleRange own, const Exposures* exposures) {
  // Capacity of the sums. More pixels would hardly change the means.
  constexpr std::uint64_t kMostPixels = 1u << 26;
  std::uint64_t pixels = 0, samples = 0;
  for (const BatchView& view : views) pixels += std::uint64_t(view.width) * view.height;
  const auto stride = static_cast<std::uint32_t>(1 + pixels / kMostPixels);
  for (std::uint32_t t = own.first; t < own.last; ++t) samples += soup::samples_at(table[t].level_max);
  FixedSums sums{gpu.allocate(16 * samples, "colours of photographs"),
                 gpu.allocate(16 * samples, "colours of photographs")};
  clear(gpu, sums);
  const std::vector<soup::TextureEntry> rows = local_rows(table, own);
  const gpu::Buffer textures = gpu.allocate(rows.size() * sizeof(soup::TextureEntry), "texture table");
  gpu.upload(textures.address(), rows);
  for_each_batch(gpu, soup, buffers, views, false, {}, views.size(), [&](std::size_t, std::size_t) {
    const BatchLayout& batch = buffers.batch();
    gpu.launch({"sum_photographs"}, batch.blocks,
               kernels::SumPhotographsArgs{buffers.views.address(), buffers.hits.address(), textures.address(),
                                           sums.low.address(), sums.high.address(),
                                           exposures ? exposures->exposure.address() : 0, batch.views, batch.blocks,
                                           own.first, own.last, stride, exposures != nullptr});
  });
  gpu.wait();  // the texture table is freed on return
  return sums;
}

}  // namespace trisoup::train
