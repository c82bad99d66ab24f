#include "train/step/forward_pass.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

#include "args/count_visible.h"
#include "args/measure_visible.h"
#include "train/step/shared_soup.h"

namespace trisoup::train {
namespace {

/// One zero word per triangle.
gpu::Buffer zeroes(gpu::Device& gpu, const SoupBuffers& soup) {
  gpu::Buffer buffer = gpu.allocate(soup.triangles * 4ull, "visible pixels");
  gpu.fill(buffer.address(), buffer.bytes(), 0);
  return buffer;
}

/// Counts the triangles that `pixels` pixels of the batch show, beginning with pixel `first`, and adds to `counts`.
void count(gpu::Device& gpu, const BatchBuffers& buffers, std::uint32_t first, std::uint32_t pixels,
           const gpu::Buffer& counts) {
  gpu.launch(
      {"count_visible", {0}}, (pixels + 63) / 64,
      kernels::CountVisibleArgs{buffers.hits.address() + sizeof(kernels::Hit) * first, counts.address(), 0, pixels, 0});
}

/// The same for all pixels of the batch.
void count(gpu::Device& gpu, const BatchBuffers& buffers, const gpu::Buffer& counts) {
  count(gpu, buffers, 0, buffers.batch().pixels, counts);
}

}  // namespace

std::optional<std::uint32_t> grow_lists_if_needed(gpu::Device& gpu, BatchBuffers& buffers) {
  const kernels::Control control = gpu.download_vector<kernels::Control>(buffers.control.address(), 1)[0];
  if (control.overflow == 0) return std::nullopt;
  buffers.make_room(control.list_peak);
  gpu.fill(buffers.control.address(), offsetof(kernels::Control, non_finite), 0);
  return control.overflow_step;
}

void for_each_batch(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                    bool colours, const StepInputs& inputs, std::size_t max_batch,
                    const std::function<void(std::size_t, std::size_t)>& visit) {
  Step step(gpu, soup, buffers);
  const std::uint64_t screen_bytes = std::max(buffers.screen.bytes(), kPassScreenBytes);
  for (std::size_t first = 0; first < views.size();) {
    std::size_t count = 0;
    std::uint64_t pixels = 0;
    while (first + count < views.size() && count < max_batch) {
      const BatchView& view = views[first + count];
      pixels += std::uint64_t(view.width) * view.height;
      if (count > 0 &&
          (pixels > kPassPixels || (count + 1) * soup.triangles * sizeof(kernels::ScreenTriangle) > screen_bytes))
        break;
      ++count;
    }
    do {
      buffers.set_batch(views.subspan(first, count), soup.triangles, false);
      step.visibility(Thresholds::half, inputs);
    } while (grow_lists_if_needed(gpu, buffers) || soup.partition->outcome() == SoupPartition::Outcome::overflow);
    if (colours) step.shade(inputs);
    visit(first, count);
    first += count;
  }
}

std::vector<std::uint32_t> count_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                         std::span<const BatchView> views) {
  const gpu::Buffer counts = zeroes(gpu, soup);
  for_each_batch(gpu, soup, buffers, views, false, {}, views.size(),
                 [&](std::size_t, std::size_t) { count(gpu, buffers, counts); });
  return gpu.download_vector<std::uint32_t>(counts.address(), soup.triangles);
}

double share_shown(gpu::Device& gpu, const SoupBuffers& soup, const BatchBuffers& buffers,
                   const kernels::ViewRecord& record, const gpu::Buffer& counts) {
  gpu.fill(counts.address(), counts.bytes(), 0);
  count(gpu, buffers, record.pixel_offset, record.width * record.height, counts);
  const auto pixels = gpu.download_vector<std::uint32_t>(counts.address(), soup.triangles);
  return double(soup.triangles - std::count(pixels.begin(), pixels.end(), 0u)) / soup.triangles;
}

TriangleVisibility measure_visible(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                   std::span<const BatchView> views) {
  constexpr std::size_t kBits = 32;  // of a word of `shown`: one bit per view
  const gpu::Buffer counts = zeroes(gpu, soup), areas = zeroes(gpu, soup), shown = zeroes(gpu, soup);
  std::vector<std::uint32_t> in_views(soup.triangles);
  for_each_batch(gpu, soup, buffers, views, false, {}, kBits, [&](std::size_t, std::size_t) {
    count(gpu, buffers, counts);
    const BatchLayout& batch = buffers.batch();
    gpu.launch(
        {"measure_visible"}, batch.tiles,
        kernels::MeasureVisibleArgs{buffers.views.address(), buffers.screen.address(), buffers.hits.address(),
                                    areas.address(), shown.address(), soup.triangles, batch.views, batch.tiles, 0});
    const auto of_batch = gpu.download_vector<std::uint32_t>(shown.address(), soup.triangles);
    for (std::uint32_t t = 0; t < soup.triangles; ++t)
      in_views[t] += static_cast<std::uint32_t>(std::popcount(of_batch[t]));
    gpu.fill(shown.address(), shown.bytes(), 0);
  });
  return {gpu.download_vector<std::uint32_t>(counts.address(), soup.triangles),
          gpu.download_vector<std::uint32_t>(areas.address(), soup.triangles), std::move(in_views)};
}

std::vector<std::vector<std::uint8_t>> visible_in_each(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                                       std::span<const BatchView> views) {
  std::vector<std::vector<std::uint8_t>> visible;
  const gpu::Buffer counts = zeroes(gpu, soup);
  for_each_batch(gpu, soup, buffers, views, false, {}, 1, [&](std::size_t, std::size_t) {
    gpu.fill(counts.address(), counts.bytes(), 0);
    count(gpu, buffers, counts);
    const auto of_view = gpu.download_vector<std::uint32_t>(counts.address(), soup.triangles);
    auto& row = visible.emplace_back(soup.triangles);
    std::transform(of_view.begin(), of_view.end(), row.begin(), [](std::uint32_t n) { return std::uint8_t(n > 0); });
  });
  return visible;
}

}  // namespace trisoup::train
