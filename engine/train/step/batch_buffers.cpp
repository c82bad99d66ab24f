#include "train/step/batch_buffers.h"

#include <algorithm>

#include "soup/soup.h"

namespace trisoup::train {

namespace {

// A GPU needs many workgroups in flight. A CPU needs long workgroups, to limit the work done once per workgroup. Shared
// memory allows about nine workgroups of shade_backward on each of the 132 processors of an H200, and four on each of
// the 128 of an RTX 4090.
constexpr std::uint32_t kGpuGroups = 1024, kCpuGroups = 64;
std::uint32_t usual_groups(const gpu::Device& gpu) {
  return gpu.info().kind == gpu::Kind::cpu ? kCpuGroups : kGpuGroups;
}

}  // namespace

BatchBuffers::BatchBuffers(gpu::Device& gpu, std::uint32_t groups)
    : mlp_groups(groups > 0 ? groups : usual_groups(gpu)),
      wide_textures(gpu.info().kind != gpu::Kind::cpu),
      one_pixel(gpu.info().kind != gpu::Kind::cpu || (gpu.info().backend == "cpu" && gpu.info().subgroup_size > 1)),
      gpu_(gpu) {
  statistics = gpu.allocate(kStatisticsRows * sizeof(kernels::Statistics), "loss sums");
  state = gpu.allocate(sizeof(kernels::StepState), "step state");
  control = gpu.allocate(sizeof(kernels::Control), "control flags");
  gpu.fill(state.address(), sizeof(kernels::StepState), 0);
  gpu.fill(control.address(), sizeof(kernels::Control), 0);
}

void BatchBuffers::grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what) {
  if (bytes <= buffer.bytes()) return;
  buffer = {};
  buffer = gpu_.allocate(bytes, what);
}

void BatchBuffers::reserve(std::uint32_t view_count, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                           bool training) {
  grow(views, view_count * sizeof(kernels::ViewRecord), "views");
  grow(image_sums, view_count * sizeof(kernels::ImageSums), "image metrics");
  grow(screen, std::uint64_t(view_count) * triangles * sizeof(kernels::ScreenTriangle), "projected triangles");
  grow(counts, tiles * 4, "tile counts");
  grow(offsets, (tiles + 1) * 4, "tile offsets");
  // An estimate: the device detects an overflow, and the lists are enlarged then.
  if (!lists) reserve_lists(std::min(most_entries, std::max<std::uint64_t>(1u << 16, 16 * tiles)));
  grow(hits, pixels * sizeof(kernels::Hit), "visible fragments");
  grow(colour, pixels * 12, "rendered colours");
  grow(target, pixels * 4, "sampled photographs");
  if (!training) return;
  grow(gradient, pixels * 16, "colour gradients");
  grow(partial, pixels * 36, "SSIM derivatives");
  grow(same, tiles * 4, "blocks without error");  // there are fewer blocks than tiles
  grow(ranks, pixels * 4, "pixels by triangle");
  grow(shown, (2ull * triangles + 1) * 4, "pixels by triangle");
  grow(mlp_partial, std::uint64_t(mlp_groups) * soup::Mlp::kParameters * 4, "MLP gradient sums");
}

void BatchBuffers::place(const BatchLayout& batch, std::uint32_t triangles, bool training) {
  batch_ = batch;
  triangles_ = triangles;
  reserve(batch_.views, batch_.pixels, batch_.tiles, triangles, training);
}

void BatchBuffers::set_batch(std::span<const BatchView> batch, std::uint32_t triangles, bool training) {
  place(lay_out(batch), triangles, training);
  gpu_.upload(views.address(), batch_.records);
}

std::uint32_t BatchBuffers::bands() const {
  const std::uint64_t pairs = std::uint64_t(batch_.tiles) * triangles_, most_pairs = most_entries * 64;
  const std::uint64_t wanted = std::max<std::uint64_t>(bands_, (pairs + most_pairs - 1) / most_pairs);
  return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(wanted, 1, std::max(batch_.tiles, 1u)));
}

void BatchBuffers::make_room(std::uint32_t peak) {
  // Allocate 50 % more, because lists grow slowly from step to step.
  const std::uint64_t wanted = peak + peak / 2;
  if (wanted <= most_entries) return reserve_lists(wanted);
  reserve_lists(most_entries);
  const std::uint64_t now = bands();
  if (now >= batch_.tiles) return reserve_lists(wanted);  // a single tile exceeds the limit
  // Bands are equal in tiles, not in entries. If a band still exceeds the limit, the next overflow divides it again.
  bands_ = static_cast<std::uint32_t>(
      std::min<std::uint64_t>(batch_.tiles, now * ((wanted + most_entries - 1) / most_entries)));
}

void BatchBuffers::reserve_lists(std::uint64_t entries) { grow(lists, entries * 4, "tile lists"); }

std::uint64_t batch_bytes(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                          bool training) {
  return views * (sizeof(kernels::ViewRecord) + sizeof(kernels::ImageSums)) +
         std::uint64_t(views) * triangles * sizeof(kernels::ScreenTriangle) + tiles * (12 + 16 * 4) +
         pixels * (16 + 12 + 4 + (training ? 16 + 36 + 4 : 0)) +
         (training ? kGpuGroups * soup::Mlp::kParameters * 4 + (2ull * triangles + 1) * 4 : 0);
}

}  // namespace trisoup::train
