#include "train/topology/hole_guard.h"

#include <algorithm>

#include "args/count_holes.h"
#include "soup/subdivision.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {
namespace {

/// Number of pixels of `views` that show each hidden triangle, but the backdrop or nothing if the hidden triangles are
/// not rendered. flags: bit 0: hidden, bit 1: backdrop (count_holes.comp). [T]
std::vector<std::uint32_t> count_holes(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                       std::span<const BatchView> views, const std::vector<std::uint32_t>& flags) {
  const gpu::Buffer flag_words = gpu.allocate(4 * flags.size(), "hidden triangles"),
                    counts = gpu.allocate(4 * flags.size(), "visible pixels");
  gpu.upload(flag_words.address(), flags);
  gpu.fill(counts.address(), counts.bytes(), 0);
  gpu::Buffer first;  // visible fragments with all triangles
  StepInputs without;
  without.hidden = flag_words.address();
  Step step(gpu, soup, buffers);
  for_each_batch(gpu, soup, buffers, views, false, {}, views.size(), [&](std::size_t, std::size_t) {
    const std::uint32_t pixels = buffers.batch().pixels;
    const std::uint64_t bytes = sizeof(kernels::Hit) * std::uint64_t(pixels);
    if (first.bytes() < bytes) first = {}, first = gpu.allocate(bytes, "visible fragments");
    gpu.copy(first.address(), buffers.hits.address(), bytes);
    step.visibility(Thresholds::half, without);
    gpu.launch({"count_holes"}, (pixels + 63) / 64,
               kernels::CountHolesArgs{first.address(), buffers.hits.address(), flag_words.address(), counts.address(),
                                       pixels, 0});
  });
  return gpu.download_vector<std::uint32_t>(counts.address(), flags.size());
}

}  // namespace

void guard_holes(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                 const std::vector<bool>& backdrop, std::size_t max_triangles, std::vector<std::uint32_t>& kept) {
  std::vector<std::uint32_t> flags(soup.triangles, 1);
  for (const std::uint32_t t : kept) flags[t] = 0;
  for (std::uint32_t t = 0; t < soup.triangles; ++t) flags[t] |= backdrop[t] ? 2 : 0;
  const std::vector<std::uint32_t> open = count_holes(gpu, soup, buffers, views, flags);

  std::vector<std::uint32_t> guards = soup::visible_at_least(open), pixels;
  for (const std::uint32_t t : guards) pixels.push_back(open[t]);
  for (const std::uint32_t i : soup::most_visible(pixels, max_triangles - kept.size())) kept.push_back(guards[i]);
  std::sort(kept.begin(), kept.end());
}

}  // namespace trisoup::train
