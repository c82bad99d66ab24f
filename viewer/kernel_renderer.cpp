#include "kernel_renderer.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "train/step/forward_pass.h"

namespace trisoup::viewer {

bool KernelRenderer::draws(const render::DrawOptions& options) {
  return options.mode == render::Mode::colour && options.aa == render::AntiAliasing::none;
}

void KernelRenderer::load(const soup::Model& model) {
  if (!cpu_) cpu_ = gpu::open_device({.backend = "cpu"});
  if (!buffers_) buffers_.emplace(*cpu_);
  model_.reset();
  model_.emplace(*cpu_, model, scene::Normalisation{model.centre, model.scale}, nullptr, &*buffers_);
}

void KernelRenderer::unload() {
  model_.reset();
  buffers_.reset();
  cpu_.reset();
}

Image KernelRenderer::draw(const render::View& view, const render::DrawOptions& options) {
  train::BatchView shown;
  shown.clip_from_world = view.clip_from_world;
  shown.world_from_clip = glm::inverse(view.clip_from_world);
  shown.width = view.width;
  shown.height = view.height;
  train::StepInputs inputs;
  inputs.background = options.background;
  train::SoupBuffers& soup = model_->soup;
  train::BatchBuffers& buffers = model_->buffers;
  soup.drop_near = options.drop_behind;
  Image image{static_cast<int>(view.width), static_cast<int>(view.height), {}};
  train::for_each_batch(*cpu_, soup, buffers, std::span(&shown, 1), true, inputs, 1, [&](std::size_t, std::size_t) {
    const std::vector<float> colour =
        cpu_->download_vector<float>(buffers.colour.address(), 3ull * buffers.batch().pixels);
    image.rgba.resize(colour.size() / 3 * 4, 255);
    for (std::size_t pixel = 0; pixel < colour.size() / 3; ++pixel)
      for (std::size_t c = 0; c < 3; ++c)
        image.rgba[4 * pixel + c] =
            static_cast<std::uint8_t>(255 * std::clamp(colour[3 * pixel + c], 0.0f, 1.0f) + 0.5f);
  });
  return image;
}

}  // namespace trisoup::viewer
