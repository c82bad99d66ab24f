#include "train/frame.h"

#include <algorithm>

namespace trisoup::train {

namespace {

// A GPU wants many workgroups in flight. A CPU wants each to run long: what it must do once per workgroup, it does often otherwise.
std::uint32_t usual_groups(const gpu::Device& gpu) { return gpu.info().kind == gpu::Kind::cpu ? 64 : 256; }

}  // namespace

Frame::Frame(gpu::Device& gpu, std::uint32_t groups) : mlp_groups(groups > 0 ? groups : usual_groups(gpu)), gpu_(gpu) {
  statistics = gpu.allocate(kStatisticsRows * sizeof(kernels::Statistics), "loss sums");
  state = gpu.allocate(sizeof(kernels::StepState), "step state");
  control = gpu.allocate(sizeof(kernels::Control), "control flags");
  gpu.fill(control.address(), sizeof(kernels::Control), 0);
}

void Frame::grow(gpu::Buffer& buffer, std::uint64_t bytes, const char* what) {
  if (bytes <= buffer.bytes()) return;
  buffer = {};
  buffer = gpu_.allocate(bytes, what);
}

void Frame::reserve(std::uint32_t view_count, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                    bool training) {
  grow(views, view_count * sizeof(kernels::ViewRecord), "views");
  grow(screen, std::uint64_t(view_count) * triangles * sizeof(kernels::ScreenTriangle), "projected triangles");
  grow(counts, tiles * 4, "tile counts");
  grow(offsets, (tiles + 1) * 4, "tile offsets");
  // A guess: lists that do not fit are found out by the device and grown.
  if (!lists) reserve_lists(std::max<std::uint64_t>(1u << 16, 16 * tiles));
  grow(hits, pixels * sizeof(kernels::Hit), "visible fragments");
  grow(colour, pixels * 12, "rendered colours");
  if (!training) return;
  grow(gradient, pixels * 16, "colour gradients");
  grow(partial, pixels * 36, "SSIM derivatives");
  grow(same, tiles * 4, "blocks without error");  // there are fewer blocks than tiles
  grow(mlp_partial, std::uint64_t(mlp_groups) * 595 * 4, "MLP gradient sums");
}

void Frame::set_batch(std::span<const BatchView> batch, std::uint32_t triangles, bool training) {
  batch_ = lay_out(batch);
  reserve(batch_.views, batch_.pixels, batch_.tiles, triangles, training);
  gpu_.upload(views.address(), batch_.records);
}

void Frame::reserve_lists(std::uint64_t entries) { grow(lists, entries * 4, "tile lists"); }

std::uint64_t frame_bytes(std::uint32_t views, std::uint64_t pixels, std::uint64_t tiles, std::uint32_t triangles,
                          bool training) {
  return views * sizeof(kernels::ViewRecord) + std::uint64_t(views) * triangles * sizeof(kernels::ScreenTriangle) +
         tiles * (12 + 16 * 4) + pixels * (16 + 12 + (training ? 16 + 36 : 0)) + (training ? 256 * 595 * 4 : 0);
}

}  // namespace trisoup::train
