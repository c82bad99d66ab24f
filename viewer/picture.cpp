#include "picture.h"

#include <chrono>
#include <span>

#include "args/interface.h"

namespace trisoup::viewer {
namespace {

const glm::vec4 kTint(1.0f, 0.0f, 0.8f, 0.6f);  // of selected triangles

}  // namespace

Rendered Picture::with(Detail detail, const Rendered& all, bool shared) const {
  const std::uint32_t width = all.view.width, height = all.view.height;
  const auto of_pixels = [&](double pixels) {
    Rendered coarse = all;
    const std::uint32_t side = pixel_side(width, height, pixels);
    coarse.view.width = (width + side - 1) / side;
    coarse.view.height = (height + side - 1) / side;
    coarse.options.aa = render::AntiAliasing::none;
    return coarse;
  };
  if (detail == Detail::all) return all;
  if (!shared) return of_pixels(kMotionPixels);
  const Rendered rest = of_pixels(kSharedRestPixels);
  // Keeps the current rendering if it shows the same at the same or a higher resolution.
  Rendered same = rendered_.value_or(Rendered{});
  const bool enough = rendered_ && same.view.width >= rest.view.width && same.view.width <= width;
  same.view.width = rest.view.width;
  same.view.height = rest.view.height;
  same.options.aa = rest.options.aa;
  return enough && same == rest ? *rendered_ : detail == Detail::rest ? rest : of_pixels(kSharedMotionPixels);
}

void Picture::compile(const render::GpuModel& model, const Rendered& next, bool changes,
                      const render::Renderer::Watch& watch) {
  // Marked even if compiling fails; render() then reports the error.
  pipelines_.insert(kind(next, changes));
  rendered_.reset();
  gpu::fit(graphics_, rendering_, {gpu::Format::rgba8, next.view.width, next.view.height}, "rendering");
  renderer_.draw(model, next.view, next.options, rendering_, watch);
  gpu_.wait();
}

void Picture::render(const render::GpuModel& model, const Rendered& next, KernelRenderer* kernels) {
  // The panels change more often than the rendering below them.
  if (rendered_ == next) return;
  rendered_.reset();
  gpu::fit(graphics_, rendering_, {gpu::Format::rgba8, next.view.width, next.view.height}, "rendering");
  if (kernels) {
    const auto start = std::chrono::steady_clock::now();
    const Image image = kernels->draw(next.view, next.options);
    graphics_.upload(rendering_, 0, std::as_bytes(std::span(image.rgba)));
    kernel_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  } else {
    renderer_.draw(model, next.view, next.options, rendering_);
  }
  rendered_ = next;
}

void Picture::show(const gpu::Image& to, const std::optional<Comparison>& comparison, const gpu::Image* marks) {
  if (!rendered_) {
    gpu::Targets targets{.colour = {&to}};
    targets.background = glm::vec4(0.18f, 0.18f, 0.2f, 1.0f);
    graphics_.draw(targets, std::span<const gpu::Draw>{});
    return;
  }
  if (comparison)
    compare(to, *comparison);
  else
    graphics_.copy(rendering_, to);
  if (marks && rendered_->options.aa == render::AntiAliasing::none) renderer_.tint(*marks, kTint, to);
}

void Picture::compare(const gpu::Image& to, const Comparison& comparison) {
  if (photograph_name_ != comparison.name) {
    const Image& photograph = *comparison.photograph;
    photograph_ = graphics_.create_image({gpu::Format::rgba8, static_cast<std::uint32_t>(photograph.width),
                                          static_cast<std::uint32_t>(photograph.height)},
                                         "photograph");
    graphics_.upload(photograph_, 0, std::as_bytes(std::span(photograph.rgba)));
    photograph_name_ = comparison.name;
  }
  const std::uint32_t width = to.shape().width, height = to.shape().height;
  const bool enlarge = rendering_.shape().width < width || rendering_.shape().height < height;
  if (enlarge) {
    gpu::fit(graphics_, enlarged_, {gpu::Format::rgba8, width, height}, "rendering");
    graphics_.copy(rendering_, enlarged_);
  }
  kernels::CompareArgs args{static_cast<float>(width), static_cast<float>(height), comparison.split, comparison.error};
  gpu::Draw draw{.vertex = "screen", .fragment = "compare"};
  draw.count = 3;
  draw.textures = {enlarge ? &enlarged_ : &rendering_, &photograph_};
  draw.set_arguments(args);
  graphics_.draw({.colour = {&to}}, draw);
}

}  // namespace trisoup::viewer
