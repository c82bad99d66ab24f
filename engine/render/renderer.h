// The real-time renderer: the graphics pipeline finds what is visible, then the MLP runs once per pixel.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/graphics.h"
#include "image/image.h"
#include "render/gpu_model.h"
#include "render/shading.h"

namespace trisoup::render {

/// What a picture shows. Numbers are those of shaders/common/surface_colour.h.
enum class Mode : std::uint32_t { colour, triangles, normals, depth, opacity, level, wireframe, channel };
inline constexpr std::uint32_t kModes = 8;
const char* to_string(Mode mode);
std::optional<Mode> mode_from(std::string_view name);

/// none: one sample per pixel, as in training. msaa: four samples of visibility, opacity tested at each, shading once
/// per triangle and pixel. ssaa: 2 x 2 samples, each shaded.
enum class AntiAliasing { none, msaa, ssaa };
const char* to_string(AntiAliasing aa);
std::optional<AntiAliasing> anti_aliasing_from(std::string_view name);

struct View {
  glm::dmat4 clip_from_world{1.0};  // of normalised coordinates; OpenGL clip space, row 0 of the image at NDC y = -1
  std::uint32_t width = 0, height = 0;
  bool operator==(const View&) const = default;
};

struct DrawOptions {
  Mode mode = Mode::colour;
  std::uint32_t channel = 0;  // of Mode::channel, 0..7: red, green, blue, mix, three latent ones, opacity
  AntiAliasing aa = AntiAliasing::none;
  glm::vec3 background{0.0f};  // display values 0..1
  bool drop_behind = false;    // leave out triangles that reach behind the camera, as published, instead of clipping
  bool operator==(const DrawOptions&) const = default;
};

/// A picture (rgba8) in memory of the host.
Image download(gpu::Graphics& graphics, const gpu::Image& picture);

/// Draws models to images. Keeps the images of its passes between pictures of one size.
class Renderer {
 public:
  /// shading: how pictures without anti-aliasing are shaded; fragments shade all others. automatic takes the answer
  /// that was measured on this device before. Without one it measures, but only with a large picture that is the first
  /// of the renderer or has a `watch`, and else takes fragments. Throws Error when the device cannot draw.
  explicit Renderer(gpu::Device& gpu, Shading shading = asked_shading());

  /// The passes of a picture.
  static constexpr int kPasses = 2;
  /// Told of each before it is drawn: its name and number, from 1 on, of kPasses.
  using Watch = std::function<void(const char* pass, int number, int of)>;

  /// Draws to `target`, rgba8, of the view's size. Nothing waits; but with `watch` the first pass is waited for before
  /// the second begins: some drivers compile shaders when they are first drawn with.
  void draw(const GpuModel& model, const View& view, const DrawOptions& options, const gpu::Image& target,
            const Watch& watch = {});

  /// The same, to memory of the host.
  Image picture(const GpuModel& model, const View& view, const DrawOptions& options);

  /// How the last picture was shaded: fragment or compute.
  Shading shading() const { return shading_; }

  /// What the first pass of the last picture without anti-aliasing found: per pixel index + 1 of the visible triangle,
  /// 0 where there is none.
  std::vector<std::uint32_t> hits();

 private:
  /// fragment or compute. shade: the second pass without anti-aliasing. watched: there is a `watch`.
  Shading choose(const GpuModel& model, const gpu::Draw& shade, const gpu::Image& target, bool watched);

  gpu::Device& gpu_;
  gpu::Graphics& graphics_;
  Shading asked_, shading_ = Shading::fragment;
  std::array<std::optional<Shading>, 2> known_;  // for an MLP in a buffer, and one compiled in
  gpu::Image hits_, depth_, target_;
  gpu::Buffer frame_;
};

}  // namespace trisoup::render
