#include "train/step/non_finite.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

#include "args/collapse_lost.h"

namespace trisoup::train {
namespace {

/// Collapses triangles with a non-finite vertex to points; returns their number.
std::uint32_t collapse_lost(gpu::Device& gpu, SoupBuffers& soup) {
  const gpu::Buffer count = gpu.allocate(4, "triangles removed");
  gpu.fill(count.address(), count.bytes(), 0);
  gpu.launch({"collapse_lost"}, (soup.triangles + 63) / 64,
             kernels::CollapseLostArgs{soup.vertices.address(), soup.vertex_moment1.address(),
                                       soup.vertex_moment2.address(), count.address(), soup.triangles, 0});
  return gpu.download_vector<std::uint32_t>(count.address(), 1)[0];
}

}  // namespace

std::string to_string(const NonFinite& f) {
  using Kind = NonFinite::Kind;
  if (f.kind == Kind::weight)
    return fmt::format(
        "step {}: weight {} of the MLP or its optimiser state was not finite and has been reset ({} in total)", f.step,
        f.place, f.count);
  if (f.kind == Kind::texel)
    return fmt::format(
        "step {}: texel {}, channel {}, of triangle {} or its optimiser state was not finite and has been reset ({} "
        "in total)",
        f.step, f.place, f.channel, f.triangle, f.count);
  if (f.count == 0)
    return fmt::format("step {}: the optimiser state of vertex {} of triangle {} was not finite and has been reset",
                       f.step, f.place, f.triangle);
  return fmt::format("step {}: vertex {} of triangle {} was not finite; the triangle is removed ({} in total)", f.step,
                     f.place, f.triangle, f.count);
}

std::vector<NonFinite> take_non_finite(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers) {
  std::vector<NonFinite> found;
  const gpu::Address at = buffers.control.address() + offsetof(kernels::Control, non_finite);
  const auto records = gpu.download_vector<kernels::NonFiniteRecord>(at, 3);
  if (std::all_of(records.begin(), records.end(), [](const kernels::NonFiniteRecord& f) { return f.count == 0; }))
    return found;
  gpu.fill(at, sizeof(kernels::Control::non_finite), 0);
  for (std::uint32_t kind = 0; kind < 3; ++kind) {
    const kernels::NonFiniteRecord& record = records[kind];
    if (record.count == 0) continue;
    NonFinite f{static_cast<NonFinite::Kind>(kind), record.step + 1ull, 0, record.index, 0, record.count};
    if (kind == NON_FINITE_VERTEX) {
      f.triangle = record.index / 9;
      f.place = record.index % 9 / 3;
      f.count = collapse_lost(gpu, soup);
    } else if (kind == NON_FINITE_TEXEL) {
      const auto sample = static_cast<std::uint32_t>(record.index / 8 + soup.source_at(soup.own().first));
      f.channel = record.index % 8;
      for (std::uint32_t t = 0; t < soup.triangles; ++t) {
        const soup::TextureEntry& row = soup.table[t];
        if (sample < row.source_offset || sample >= row.source_offset + soup::samples_in(row.level_min, row.level_max))
          continue;
        f.triangle = t;
        f.place = sample - row.source_offset;
      }
    }
    found.push_back(f);
  }
  return found;
}

}  // namespace trisoup::train
