#include "run/memory_need.h"

#include <algorithm>
#include <utility>

#include "soup/texture_table.h"
#include "train/config/schedule.h"
#include "train/step/batch_buffers.h"
#include "train/step/camera_motion.h"
#include "train/step/forward_pass.h"
#include "train/step/shared_soup.h"
#include "train/step/small_views.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {
namespace {

/// The largest value in 0..high for which `fits` is true. Every smaller value must fit, too.
template <typename Fits>
std::uint32_t largest(std::uint32_t high, Fits&& fits) {
  std::uint32_t low = 0;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2 + (high - low) % 2;
    if (fits(middle))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

}  // namespace

BatchSize largest_batch(const std::vector<scene::View>& views, const Settings& settings) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> sizes;
  for (const scene::View& v : views)
    sizes.emplace_back(std::uint64_t(v.camera.width) * v.camera.height,
                       std::uint64_t((v.camera.width + 7) / 8) * ((v.camera.height + 7) / 8));
  std::sort(sizes.rbegin(), sizes.rend());
  BatchSize size;
  size.views = std::min<std::uint32_t>(settings.batch, static_cast<std::uint32_t>(sizes.size()));
  for (std::uint32_t i = 0; i < size.views; ++i) {
    size.pixels += sizes[i].first;
    size.tiles += sizes[i].second;
  }
  return size;
}

std::uint64_t default_most_triangles(const Settings& s) { return 8ull * s.triangles; }

MemoryNeed memory_need(const scene::Scene& scene, const Settings& s, std::uint32_t ranks) {
  MemoryNeed need;
  const bool small = small_scale(s) < 1 && small_end(s) > 0;
  for (const scene::View& v : scene.train) {
    const double scale = small ? small_view_scale(v.camera, s) : 0.0;
    need.photographs += static_cast<std::uint64_t>(4.0 * v.camera.width * v.camera.height * (1 + scale * scale));
    if (s.lambda_depth > 0) need.photographs += 4 * v.depth.inverse.size();
  }
  // Evaluation keeps the photographs of up to four views on the device.
  std::uint64_t largest_test = 0;
  for (const auto* views : {&scene.test, &scene.validation})
    for (const scene::View& v : *views)
      largest_test =
          std::max(largest_test, std::uint64_t(v.camera.width) * static_cast<std::uint64_t>(v.camera.height));
  // The real recipe splits beyond the budget between two refinements. It needs room for at least a quarter more.
  std::uint64_t max_triangles = s.triangles;
  if (s.recipe == Recipe::real) max_triangles = s.most_triangles > 0 ? s.most_triangles : s.triangles + s.triangles / 4;
  const BatchSize batch = largest_batch(scene.train, s);
  need.buffers = batch_bytes(batch.views, std::max(batch.pixels, kPassPixels), batch.tiles,
                             static_cast<std::uint32_t>(std::max<std::uint64_t>(max_triangles, s.init_count)), true) +
                 kPassScreenBytes + (64ull << 20) + 4 * largest_test * 4;
  // Refinement copies the texture arrays one after the other, so only one array, the logits at most, exists twice at
  // any time. Added to that are texture table rows, parents and corners of triangles.
  const std::uint64_t logits = max_triangles * soup::samples_in(s.level_min, s.level_max) * soup::kChannels * 4 / ranks;
  const std::uint64_t change =
      triangle_bytes(max_triangles) + max_triangles * (2 * sizeof(soup::TextureEntry) + 4 + 24) / ranks + logits * 2;
  // After the last step fill_unseen() sums the pixels of all samples, in two words of four values.
  const std::uint64_t sums =
      starts_from_surface(s)
          ? max_triangles * (32ull * soup::samples_at(s.level_max) + sizeof(soup::TextureEntry)) / ranks
          : 0;
  need.soup = std::max({soup_bytes(s.init_count, kCoarseLevel, kCoarseLevel, ranks),
                        soup_bytes(max_triangles, s.level_min, s.level_max, ranks) + sums, change});
  if (s.pose_corrections) need.buffers += kMotionBytes * scene.train.size();
  if (ranks > 1) need.buffers += batch.pixels * SharedSoup::kPixelBytes;
  return need;
}

std::uint32_t triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                 std::uint32_t ranks) {
  return largest(settings.triangles, [&](std::uint32_t n) {
    Settings s = settings;
    set_budget(s, n);
    return memory_need(scene, s, ranks).total() <= bytes;
  });
}

void limit_budget(const scene::Scene& scene, Settings& settings, std::uint64_t bytes, std::uint32_t ranks) {
  if (!surface_decides_budget(settings)) return;
  if (const std::uint32_t fits = triangles_that_fit(scene, settings, bytes, ranks)) set_budget(settings, fits);
}

std::uint32_t shrinking_that_fits(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                  std::uint32_t ranks) {
  for (std::uint32_t factor = 2; factor <= 64; factor *= 2) {
    const auto side = [&](int length) { return std::max(1, length / static_cast<int>(factor)); };
    scene::Scene small;
    for (const auto& [from, to] :
         {std::pair(&scene.train, &small.train), {&scene.test, &small.test}, {&scene.validation, &small.validation}})
      for (const scene::View& v : *from)
        to->push_back({v.name, scene::resized(v.camera, side(v.camera.width), side(v.camera.height)), {}});
    if (memory_need(small, settings, ranks).total() <= bytes) return factor;
  }
  return 0;
}

std::uint64_t disk_need(const scene::Scene& scene, const Settings& s) {
  const std::uint64_t triangles = std::max<std::uint64_t>(s.triangles, s.most_triangles);
  // Logits and their two moments, vertices with 7 moments, and a row of the texture table (trainer_checkpoint.cpp).
  const std::uint64_t checkpoint =
      triangles * (3ull * soup::samples_in(s.level_min, s.level_max) * soup::kChannels * sizeof(float) + 9 * 4 +
                   (9 + 3) * 4 + sizeof(soup::TextureEntry));
  const std::uint64_t model = triangles * soup::samples_at(s.level_max) * soup::kChannels;
  std::uint64_t renders = 0;  // photograph and rendering side by side, as PNG at most three bytes per pixel
  for (const scene::View& v : scene.test)
    renders += 6ull * static_cast<std::uint64_t>(v.camera.width) * static_cast<std::uint64_t>(v.camera.height);
  return 2 * checkpoint + model + renders;
}

Smaller smaller_run(const scene::Scene& scene, const Settings& settings, std::uint64_t needed,
                    std::uint64_t available) {
  // Assumes that the next training exceeds its estimate by the same factor.
  const std::uint64_t foreseen = memory_need(scene, settings).total();
  const double share = needed > foreseen ? double(foreseen) / double(needed) : 1.0;
  Settings s = settings;
  s.most_triangles = 0;  // not given: the default follows from the memory
  const auto memory = static_cast<std::uint64_t>(share * double(available));
  return {triangles_that_fit(scene, s, memory), memory};
}

std::uint32_t most_triangles_that_fit(const scene::Scene& scene, const Settings& settings, std::uint64_t bytes,
                                      std::uint32_t ranks) {
  const auto high = static_cast<std::uint32_t>(std::min<std::uint64_t>(default_most_triangles(settings), 0xffffffffu));
  return largest(high, [&](std::uint32_t n) {
    Settings s = settings;
    s.most_triangles = n;
    return n <= settings.triangles || memory_need(scene, s, ranks).total() <= bytes;
  });
}

}  // namespace trisoup::train
