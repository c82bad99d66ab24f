// Renderings of a model.
#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "api/impl.h"
#include "base/error.h"
#include "render/pixel_data.h"
#include "train/step/forward_pass.h"

namespace trisoup {
namespace {

/// The model on that device: as an earlier call left it, or newly loaded. The caller has locked the device.
train::LoadedModel& on_device(const Model::Impl& impl, const std::shared_ptr<Device::Impl>& device) {
  std::unique_ptr<train::LoadedModel>& loaded = device->models[&impl];
  if (loaded) return *loaded;
  const soup::Model& model = impl.model;
  try {
    loaded =
        std::make_unique<train::LoadedModel>(*device->device, model, scene::Normalisation{model.centre, model.scale});
    const std::lock_guard lock(impl.guard);
    std::erase_if(impl.on_devices, [](const auto& known) { return known.expired(); });
    impl.on_devices.push_back(device);
  } catch (...) {
    device->models.erase(&impl);
    throw;
  }
  return *loaded;
}

void take_hits(Rendering& rendering, const std::vector<kernels::Hit>& hits, const RenderOptions& options,
               const soup::Model& model, const scene::Camera& camera) {
  if (options.alpha)
    for (const kernels::Hit& hit : hits) rendering.alpha.push_back(hit.triangle > 0 ? 1.0f : 0.0f);
  if (options.triangle)
    for (const kernels::Hit& hit : hits) rendering.triangle.push_back(static_cast<std::int32_t>(hit.triangle) - 1);
  if (!options.barycentrics && !options.depth && !options.normal && !options.features) return;
  std::vector<std::uint32_t> triangles;
  triangles.reserve(hits.size());
  for (const kernels::Hit& hit : hits) triangles.push_back(hit.triangle);
  const std::vector<render::SurfacePoint> points = render::surface_points(model, camera, triangles);
  const auto values = [&](render::PixelData kind) { return render::values_of(kind, points, camera, model); };
  if (options.barycentrics) rendering.barycentrics = values(render::PixelData::barycentrics);
  if (options.depth) rendering.depth = values(render::PixelData::depth);
  if (options.normal) rendering.normal = values(render::PixelData::normal);
  if (options.features) rendering.features = values(render::PixelData::features);
}

}  // namespace

Picture Model::render(Device& device, const Camera& camera) const {
  Rendering rendering = render(device, camera, RenderOptions{});
  return {rendering.width, rendering.height, std::move(rendering.colour)};
}

Rendering Model::render(Device& device, const Camera& camera, const RenderOptions& options) const {
  const soup::Model& model = impl_->model;
  const scene::Camera seen = scene::normalised(scene_camera(camera), scene::Normalisation{model.centre, model.scale});
  const DeviceLock lock(device);
  train::LoadedModel& loaded = on_device(*impl_, device.impl());
  gpu::Device& gpu = lock.gpu();
  train::BatchBuffers& buffers = loaded.buffers;
  const train::BatchView view = train::batch_view(seen, impl_->near, impl_->far);
  train::StepInputs inputs;
  inputs.background = model.background;
  if (options.background) {
    const std::array<float, 3>& b = *options.background;
    if (!std::all_of(b.begin(), b.end(), [](float v) { return v >= 0 && v <= 1; }))
      throw Error("background: ({}, {}, {}); give values from 0 to 1", b[0], b[1], b[2]);
    inputs.background = {b[0], b[1], b[2]};
  }
  Rendering rendering;
  rendering.width = camera.width;
  rendering.height = camera.height;
  const std::size_t pixels = std::size_t(camera.width) * std::size_t(camera.height);
  std::vector<kernels::Hit> hits;
  train::for_each_batch(gpu, loaded.soup, buffers, std::span(&view, 1), options.colour, inputs, 1,
                        [&](std::size_t, std::size_t) {
                          if (options.colour)
                            rendering.colour = gpu.download_vector<float>(buffers.colour.address(), 3 * pixels);
                          if (options.alpha || options.triangle || options.barycentrics || options.depth ||
                              options.normal || options.features)
                            hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), pixels);
                        });
  take_hits(rendering, hits, options, model, seen);
  return rendering;
}

}  // namespace trisoup
