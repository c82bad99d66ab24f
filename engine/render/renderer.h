// The real-time renderer. The graphics pipeline finds the visible triangles, then the MLP runs once per pixel.
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

/// What a picture shows. The values match shaders/common/surface_colour.h.
enum class Mode : std::uint32_t { colour, triangles, normals, depth, opacity, level, wireframe, channel };
inline constexpr std::uint32_t kModes = 8;
const char* to_string(Mode mode);
std::optional<Mode> mode_from(std::string_view name);

/// none: one sample per pixel, as in training. msaa: four visibility samples per pixel, opacity tested at each, shading
/// once per triangle and pixel. ssaa: 2 x 2 samples, each shaded.
enum class AntiAliasing { none, msaa, ssaa };
const char* to_string(AntiAliasing aa);
std::optional<AntiAliasing> anti_aliasing_from(std::string_view name);

struct View {
  glm::dmat4 clip_from_world{1.0};  // from normalised coordinates; OpenGL clip space, image row 0 at NDC y = -1
  std::uint32_t width = 0, height = 0;
  bool operator==(const View&) const = default;
};

struct DrawOptions {
  Mode mode = Mode::colour;
  std::uint32_t channel = 0;  // for Mode::channel, 0..7: red, green, blue, mix, three latent, opacity
  AntiAliasing aa = AntiAliasing::none;
  glm::vec3 background{0.0f};  // display values 0..1
  bool drop_behind = false;    // discard triangles that reach behind the camera, as published, instead of clipping them
  bool operator==(const DrawOptions&) const = default;
};

/// Downloads an rgba8 image to host memory.
Image download(gpu::Graphics& graphics, const gpu::Image& picture);

/// Uploads marks for Renderer::tint(), 255 for each marked triangle of a model and 0 for others; `image` is reused if
/// it has the right size.
void upload_marks(gpu::Graphics& graphics, std::vector<std::uint8_t> marks, gpu::Image& image);

/// Draws models into images. The images of its passes are reused while the picture size stays the same.
class Renderer {
 public:
  /// shading: how pictures without anti-aliasing are shaded; all others are shaded in fragment shaders. automatic uses
  /// the result of an earlier measurement on this device. Without one it measures, but only for a large picture that is
  /// the renderer's first or has a `watch`; otherwise it uses fragment shaders. Throws Error if the device cannot draw.
  explicit Renderer(gpu::Device& gpu, Shading shading = asked_shading());

  /// Number of passes per picture.
  static constexpr int kPasses = 2;
  /// Called before each pass with the pass's name, its number, starting at 1, and kPasses.
  using Watch = std::function<void(const char* pass, int number, int of)>;

  /// Draws to `target`, rgba8, of the view's size. The call does not wait for the device. With `watch` it waits for the
  /// first pass before the second begins, because some drivers compile shaders at the first draw.
  void draw(const GpuModel& model, const View& view, const DrawOptions& options, const gpu::Image& target,
            const Watch& watch = {});

  /// The same, downloaded to host memory.
  Image picture(const GpuModel& model, const View& view, const DrawOptions& options);

  /// How the last picture was shaded: fragment or compute.
  Shading shading() const { return shading_; }

  /// Result of the first pass of the last picture without anti-aliasing: per pixel the visible triangle's index + 1, or
  /// 0.
  std::vector<std::uint32_t> hits();
  /// Blends a colour, with its alpha, over the marked triangles in a copy of the last picture without anti-aliasing.
  /// marks: from upload_marks(). target: rgba8 or a window's image, of any size.
  void tint(const gpu::Image& marks, const glm::vec4& colour, const gpu::Image& target);

 private:
  /// Returns fragment or compute. shade: the second pass without anti-aliasing. watched: draw() has a `watch`.
  Shading choose(const GpuModel& model, const gpu::Draw& shade, const gpu::Image& target, bool watched);

  gpu::Device& gpu_;
  gpu::Graphics& graphics_;
  Shading asked_, shading_ = Shading::fragment;
  std::array<std::optional<Shading>, 2> known_;  // results for an MLP in a buffer and for one compiled in
  gpu::Image hits_, depth_, target_;
  gpu::Buffer frame_;
};

}  // namespace trisoup::render
