#include "render/renderer.h"

#include <algorithm>
#include <array>
#include <span>

#include "args/interface.h"
#include "args/soup.h"
#include "scene/camera.h"

namespace trisoup::render {
namespace {

constexpr std::array<const char*, kModes> kModeNames{"colour",  "triangles", "normals",   "depth",
                                                     "opacity", "level",     "wireframe", "channel"};
constexpr std::array<const char*, 3> kAaNames{"none", "msaa", "ssaa"};

kernels::DrawFrame frame_of(const GpuModel& model, const View& view, const DrawOptions& options) {
  const glm::dmat4 world_from_clip = glm::inverse(view.clip_from_world);
  const scene::PixelRays rays = scene::pixel_rays(world_from_clip);
  kernels::DrawFrame frame{};
  frame.clip_from_world = glm::mat4(view.clip_from_world);
  frame.eye = glm::vec4(scene::eye(world_from_clip), 1.0);
  frame.ray = glm::vec4(rays.centre, 0.0);
  frame.ray_x = glm::vec4(rays.x, 0.0);
  frame.ray_y = glm::vec4(rays.y, 0.0);
  frame.background = glm::vec4(options.background, 1.0f);
  frame.pixel_x = 2.0f / static_cast<float>(view.width);
  frame.pixel_y = 2.0f / static_cast<float>(view.height);
  // Depth range along the viewing direction of the box that contains most of the model.
  const soup::Box& box = model.box;
  float nearest = 1e30f, farthest = 0.0f;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 corner(i & 1 ? box.high.x : box.low.x, i & 2 ? box.high.y : box.low.y,
                           i & 4 ? box.high.z : box.low.z);
    const float w = (frame.clip_from_world * glm::vec4(corner, 1.0f)).w;
    nearest = std::min(nearest, w);
    farthest = std::max(farthest, w);
  }
  frame.depth_near = std::max(nearest, 0.0f);
  frame.depth_far = std::max(farthest, frame.depth_near + 1e-6f);
  frame.channel = options.channel;
  return frame;
}

/// The second pass, which shades the visible triangles, without textures and uniform buffers.
gpu::Draw shading_draw(const GpuModel& model, const DrawOptions& options, AntiAliasing aa) {
  gpu::Draw shade{.vertex = "screen", .fragment = "shade"};
  const bool fixed = !model.mlp_constants.empty();
  if (fixed) shade.fragment = "shade_fixed";
  if (aa == AntiAliasing::msaa) shade.fragment = fixed ? "shade_multisampled_fixed" : "shade_multisampled";
  if (aa == AntiAliasing::ssaa) shade.fragment = fixed ? "shade_supersampled_fixed" : "shade_supersampled";
  shade.constants = {static_cast<std::uint32_t>(options.mode)};
  shade.constants.insert(shade.constants.end(), model.mlp_constants.begin(), model.mlp_constants.end());
  shade.count = 3;
  return shade;
}

}  // namespace

const char* to_string(Mode mode) { return kModeNames[static_cast<std::size_t>(mode)]; }
std::optional<Mode> mode_from(std::string_view name) {
  for (std::size_t i = 0; i < kModeNames.size(); ++i)
    if (name == kModeNames[i]) return static_cast<Mode>(i);
  return {};
}
const char* to_string(AntiAliasing aa) { return kAaNames[static_cast<std::size_t>(aa)]; }
std::optional<AntiAliasing> anti_aliasing_from(std::string_view name) {
  for (std::size_t i = 0; i < kAaNames.size(); ++i)
    if (name == kAaNames[i]) return static_cast<AntiAliasing>(i);
  return {};
}

Renderer::Renderer(gpu::Device& gpu, Shading shading) : gpu_(gpu), graphics_(gpu::graphics_of(gpu)), asked_(shading) {
  frame_ = gpu.allocate(sizeof(kernels::DrawFrame), "frame");
}

Shading Renderer::choose(const GpuModel& model, const gpu::Draw& shade, const gpu::Image& target, bool watched) {
  if (target.shape().format != gpu::Format::rgba8) return Shading::fragment;
  if (asked_ != Shading::automatic) return asked_;
  std::optional<Shading>& known = known_[model.mlp_constants.empty() ? 0 : 1];
  // With `watched` the driver compiles for this picture and the user waits already. A measurement at another time would
  // be a hitch.
  if (known && !watched) return *known;
  const auto remembered = shading_from(graphics_.recall(shade.fragment));
  known = Shading::fragment;
  const std::uint32_t pixels = target.shape().width * target.shape().height;
  const bool large = pixels >= kLeastPixels && model.triangles >= kLeastTriangles;
  if (remembered && *remembered != Shading::automatic) {
    known = remembered;
  } else if (large && shade.constants.at(0) == static_cast<std::uint32_t>(Mode::colour)) {
    if (const auto measured = measured_shading(gpu_, shade, model.triangles)) {
      known = measured;
      graphics_.remember(shade.fragment, to_string(*measured));
    }
  }
  return *known;
}

void Renderer::draw(const GpuModel& model, const View& view, const DrawOptions& options, const gpu::Image& target,
                    const Watch& watch) {
  AntiAliasing aa = options.aa;
  // Some devices cannot multisample integers. 2 x 2 supersampling looks better anyway.
  if (aa == AntiAliasing::msaa && !graphics_.can_multisample(gpu::Format::r32_uint, 4)) aa = AntiAliasing::ssaa;
  const std::uint32_t samples = aa == AntiAliasing::msaa ? 4 : 1, side = aa == AntiAliasing::ssaa ? 2 : 1;
  const std::uint32_t width = side * view.width, height = side * view.height;
  gpu::fit(graphics_, hits_, {gpu::Format::r32_uint, width, height, 0, samples}, "visible triangles");
  gpu::fit(graphics_, depth_, {gpu::Format::depth32, width, height, 0, samples}, "depth");

  const kernels::DrawFrame frame = frame_of(model, view, options);
  gpu_.upload(frame_.address(), std::as_bytes(std::span(&frame, 1)));

  kernels::SoupArgs args{};
  args.pixel_x = 2.0f / static_cast<float>(width);
  args.pixel_y = 2.0f / static_cast<float>(height);
  gpu::Draw opaque{.vertex = "soup", .fragment = "opaque"};
  opaque.constants = {options.drop_behind};
  opaque.depth = gpu::Depth::nearest;
  opaque.vertices = model.corners.address();
  opaque.vertex_vectors = 1;
  opaque.count = 3 * model.opaque;
  opaque.textures = {&model.opacities, &model.table};
  opaque.uniforms = {{model.mlp.address(), model.mlp.bytes()}, {frame_.address(), frame_.bytes()}};
  opaque.set_arguments(args);
  gpu::Draw masked = opaque;
  masked.fragment = aa == AntiAliasing::msaa ? "masked_multisampled" : "masked";
  masked.first = opaque.count;
  masked.count = 3 * model.masked;
  if (watch) watch("visibility", 1, kPasses);
  graphics_.draw({.colour = {&hits_}, .depth = &depth_}, std::array{opaque, masked});
  if (watch) {
    gpu_.wait();
    watch("shading", 2, kPasses);
  }

  gpu::Draw shade = shading_draw(model, options, aa);
  shade.textures = {&hits_, &model.table, &model.features};
  shade.uniforms = opaque.uniforms;
  // With one sample per pixel, the depth of the first pass tells which pixels need shading.
  if (aa == AntiAliasing::none) shade.depth = gpu::Depth::drawn;
  shading_ = aa == AntiAliasing::none ? choose(model, shade, target, static_cast<bool>(watch)) : Shading::fragment;
  if (shading_ == Shading::compute) {
    graphics_.compute(as_kernel(shade), target);
    return;
  }
  gpu::Targets targets{.colour = {&target}};
  targets.background = frame.background;
  if (aa == AntiAliasing::none) {
    targets.depth = &depth_;
    targets.keep_depth = true;
  }
  graphics_.draw(targets, shade);
}

Image Renderer::picture(const GpuModel& model, const View& view, const DrawOptions& options) {
  gpu::fit(graphics_, target_, {gpu::Format::rgba8, view.width, view.height}, "picture");
  draw(model, view, options, target_);
  return download(graphics_, target_);
}

Image download(gpu::Graphics& graphics, const gpu::Image& picture) {
  const gpu::ImageShape& shape = picture.shape();
  Image image{static_cast<int>(shape.width), static_cast<int>(shape.height), {}};
  image.rgba.resize(std::size_t(shape.width) * shape.height * 4);
  graphics.download(picture, 0, std::as_writable_bytes(std::span(image.rgba)));
  return image;
}

std::vector<std::uint32_t> Renderer::hits() {
  std::vector<std::uint32_t> hits(std::size_t(hits_.shape().width) * hits_.shape().height);
  graphics_.download(hits_, 0, std::as_writable_bytes(std::span(hits)));
  return hits;
}

void upload_marks(gpu::Graphics& graphics, std::vector<std::uint8_t> marks, gpu::Image& image) {
  constexpr std::size_t kWidth = kernels::kTableWidth;
  const std::size_t rows = std::max<std::size_t>(1, (marks.size() + kWidth - 1) / kWidth);
  marks.resize(rows * kWidth);
  gpu::fit(graphics, image, {gpu::Format::r8, kernels::kTableWidth, static_cast<std::uint32_t>(rows)}, "marks");
  graphics.upload(image, 0, std::as_bytes(std::span(marks)));
}

void Renderer::tint(const gpu::Image& marks, const glm::vec4& colour, const gpu::Image& target) {
  const kernels::TintArgs args{static_cast<float>(target.shape().width),
                               static_cast<float>(target.shape().height),
                               colour.r,
                               colour.g,
                               colour.b,
                               colour.a};
  gpu::Draw draw{.vertex = "screen", .fragment = "tint"};
  draw.blend = true;
  draw.count = 3;
  draw.textures = {&hits_, &marks};
  draw.set_arguments(args);
  graphics_.draw({.colour = {&target}, .clear = false}, draw);
}

}  // namespace trisoup::render
