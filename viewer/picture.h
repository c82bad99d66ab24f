// What a window shows below its panels: a model's rendering, which is kept until another is wanted, and a photograph
// beside it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "detail.h"
#include "gpu/graphics.h"
#include "image/image.h"
#include "render/renderer.h"

namespace trisoup::viewer {

/// What a rendering shows.
struct Rendered {
  std::uint64_t model = 0;  // counts what the model has been
  render::View view;
  render::DrawOptions options;
  bool operator==(const Rendered&) const = default;
};

/// A photograph to compare a rendering with.
struct Comparison {
  const Image* photograph = nullptr;
  std::string name;
  float split = 0.0f;  // share of the width, from the left, that shows the photograph; the rest the rendering
  bool error = false;  // their difference in place of both
};

class Picture {
 public:
  /// Throws Error when the device cannot draw.
  explicit Picture(gpu::Device& gpu) : gpu_(gpu), renderer_(gpu) {}

  /// `all`, which has all pixels, with as many as `detail` asks for. shared: beside a training that wants the CPU.
  Rendered with(Detail detail, const Rendered& all, bool shared) const;

  /// Whether drawing it makes a driver compile. changes: the model does, so its MLP is no part of the pipelines.
  bool is_new(const Rendered& next, bool changes) const { return !pipelines_.contains(kind(next, changes)); }
  /// Draws it and waits for it, which leaves its pipelines and nothing else. watch: as in Renderer::draw.
  void compile(const render::GpuModel& model, const Rendered& next, bool changes, const render::Renderer::Watch& watch);

  /// Draws it, unless that is what there is.
  void render(const render::GpuModel& model, const Rendered& next);
  /// Puts the rendering on `to`, enlarged where it is smaller, with the photograph if there is one. Without a
  /// rendering: a plain grey.
  void show(const gpu::Image& to, const std::optional<Comparison>& comparison);
  /// The photograph of that name may be another from now on.
  void forget_photograph() { photograph_name_.clear(); }
  const gpu::ImageShape& shape() const { return rendering_.shape(); }

 private:
  /// Model, mode and smoothing.
  using Kind = std::tuple<std::uint64_t, render::Mode, render::AntiAliasing>;
  static Kind kind(const Rendered& r, bool changes) { return {changes ? 0 : r.model, r.options.mode, r.options.aa}; }

  gpu::Device& gpu_;
  gpu::Graphics& graphics_ = gpu::graphics_of(gpu_);
  render::Renderer renderer_;
  gpu::Image rendering_, enlarged_, photograph_;
  std::string photograph_name_;
  std::optional<Rendered> rendered_;  // what rendering_ holds
  std::set<Kind> pipelines_;
};

}  // namespace trisoup::viewer
