// The image below the panels: a cached rendering of the model, optionally compared with a photograph.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "detail.h"
#include "gpu/graphics.h"
#include "image/image.h"
#include "kernel_renderer.h"
#include "render/renderer.h"
#include "screen_selection.h"

namespace trisoup::viewer {

/// Identifies a rendering.
struct Rendered {
  std::uint64_t model = 0;  // version of the model
  render::View view;
  render::DrawOptions options;
  bool operator==(const Rendered&) const = default;
};

/// A photograph to compare a rendering with.
struct Comparison {
  const Image* photograph = nullptr;
  std::string name;
  float split = 0.0f;  // part of the width, from the left, that shows the photograph, 0 to 1
  bool error = false;  // show the difference instead
};

class Picture {
 public:
  /// Throws Error if the device cannot draw.
  explicit Picture(gpu::Device& gpu) : gpu_(gpu), renderer_(gpu) {}

  /// Returns `all`, which is at full resolution, at the resolution for `detail`. shared: a training uses the same CPU.
  Rendered with(Detail detail, const Rendered& all, bool shared) const;

  /// True if drawing `next` makes the driver compile shaders. changes: the model changes (training), so pipelines do
  /// not contain its MLP.
  bool is_new(const Rendered& next, bool changes) const { return !pipelines_.contains(kind(next, changes)); }
  /// Creates the pipelines for `next` by drawing it; the rendering is discarded. watch: as in Renderer::draw.
  void compile(const render::GpuModel& model, const Rendered& next, bool changes, const render::Renderer::Watch& watch);

  /// Draws `next`, unless it is the current rendering. kernels: draws it instead of the device, if not null.
  void render(const render::GpuModel& model, const Rendered& next, KernelRenderer* kernels);
  /// Milliseconds that the last rendering by kernels took since the last call; 0 if there was none.
  double take_kernel_ms() { return std::exchange(kernel_ms_, 0.0); }
  /// Copies the rendering to `to`, enlarged if it is smaller, with the photograph if one is given. Without a rendering
  /// `to` becomes grey. marks: tints these triangles (render::upload_marks) if the rendering has no anti-aliasing;
  /// null: none.
  void show(const gpu::Image& to, const std::optional<Comparison>& comparison, const gpu::Image* marks = nullptr);
  /// Draws anew at the next render(), because the model has changed. Its pipelines stay.
  void forget_rendering() { rendered_.reset(); }
  /// The visible triangle of each pixel of the current rendering, which must have no anti-aliasing.
  TrianglePicture triangles() { return {rendering_.shape().width, rendering_.shape().height, renderer_.hits()}; }
  /// Drops the cached photograph: its name may now mean another one.
  void forget_photograph() { photograph_name_.clear(); }
  const gpu::ImageShape& shape() const { return rendering_.shape(); }

 private:
  void compare(const gpu::Image& to, const Comparison& comparison);
  /// Model version, mode and anti-aliasing.
  using Kind = std::tuple<std::uint64_t, render::Mode, render::AntiAliasing>;
  static Kind kind(const Rendered& r, bool changes) { return {changes ? 0 : r.model, r.options.mode, r.options.aa}; }

  gpu::Device& gpu_;
  gpu::Graphics& graphics_ = gpu::graphics_of(gpu_);
  render::Renderer renderer_;
  gpu::Image rendering_, enlarged_, photograph_;
  std::string photograph_name_;
  std::optional<Rendered> rendered_;  // what rendering_ holds
  std::set<Kind> pipelines_;
  double kernel_ms_ = 0;
};

}  // namespace trisoup::viewer
