#include "headless.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/output_text.h"
#include "file_cameras.h"
#include "image/image_file.h"
#include "render/exr_layers.h"
#include "render/pixel_data.h"
#include "train/quality/evaluate.h"
#include "video.h"

namespace trisoup::viewer {
namespace {

using nlohmann::json;

constexpr double kDegrees = std::numbers::pi / 180;

struct Setting {
  gpu::Device& gpu;
  const CommandLine& options;
  const Subject& subject;
  render::GpuModel model;
  render::Renderer renderer;
  render::DrawOptions draw;

  Setting(gpu::Device& device, const CommandLine& o, const Subject& s)
      : gpu(device),
        options(o),
        subject(s),
        model(render::upload_model(device, s.model)),
        renderer(device),
        draw(o.draw) {
    draw.aa = o.aa.value_or(o.benchmark ? render::AntiAliasing::none : render::AntiAliasing::msaa);
    draw.background = o.background.value_or(s.model.background);
    // Views of the dataset are drawn as in the evaluation.
    draw.drop_behind = s.model.drop_near;
    train::check_clip_planes(near(), far());
  }

  double near() const { return options.near.value_or(subject.near); }
  double far() const { return options.far.value_or(subject.far); }
  scene::Camera lens(scene::Camera camera) const {
    if (options.fov) camera.fx = camera.fy = 0.5 * camera.height / std::tan(0.5 * *options.fov * kDegrees);
    return camera;
  }
  render::View view(const scene::Camera& camera) const { return render::view_of(lens(camera), near(), far()); }
  int frames() const { return options.frames.value_or(120); }
  double elevation() const { return options.elevation.value_or(20.0) * kDegrees; }
  glm::ivec2 size() const {
    if (options.size) return *options.size;
    return {1280, 720};
  }
  scene::Camera camera(std::size_t index) const {
    const scene::Camera& c = subject.cameras[index].camera;
    return options.size ? render::reshaped(c, options.size->x, options.size->y) : c;
  }
};

Image transparent_picture(Setting& s, const render::View& view) {
  render::DrawOptions draw = s.draw;
  draw.background = glm::vec3(0.0f);
  const Image over_black = s.renderer.picture(s.model, view, draw);
  draw.background = glm::vec3(1.0f);
  return render::transparent(over_black, s.renderer.picture(s.model, view, draw));
}

/// Returns the points that the pixels' centres show.
std::vector<render::SurfacePoint> points_of(Setting& s, const scene::Camera& camera) {
  render::DrawOptions one_sample = s.draw;
  one_sample.aa = render::AntiAliasing::none;
  s.renderer.picture(s.model, s.view(camera), one_sample);
  return render::surface_points(s.subject.model, s.lens(camera), s.renderer.hits());
}

/// A picture, and what --data adds to it.
struct Drawn {
  Image image;                               // with straight alpha if --background none
  std::optional<Image> cutout;               // with straight alpha, if that or alpha is wanted
  std::vector<render::SurfacePoint> points;  // of the pixels' centres; empty: not wanted
};

Drawn drawn_picture(Setting& s, const scene::Camera& camera) {
  const render::View view = s.view(camera);
  const auto& data = s.options.data;
  Drawn drawn;
  if (!s.options.transparent) drawn.image = s.renderer.picture(s.model, view, s.draw);
  const auto alphas = std::count(data.begin(), data.end(), render::PixelData::alpha);
  if (s.options.transparent || alphas > 0) drawn.cutout = transparent_picture(s, view);
  if (s.options.transparent) drawn.image = *drawn.cutout;
  if (static_cast<std::size_t>(alphas) < data.size()) drawn.points = points_of(s, camera);
  return drawn;
}

/// Writes NAME.KIND.npy beside NAME.png for each kind.
void write_npy(const Setting& s, const std::filesystem::path& png, const Drawn& drawn, const scene::Camera& lens) {
  for (const render::PixelData kind : s.options.data) {
    std::filesystem::path path = png;
    path.replace_extension(fmt::format(".{}.npy", render::kPixelDataNames[static_cast<std::size_t>(kind)]));
    write_file_atomically(
        path, bytes_of(kind == render::PixelData::alpha ? render::npy_of_alpha(*drawn.cutout)
                                                        : render::npy_of(kind, drawn.points, lens, s.subject.model)));
  }
}

/// Writes NAME.exr beside NAME.png.
void write_exr(const Setting& s, const std::filesystem::path& png, const Drawn& drawn, const scene::Camera& lens) {
  std::vector<ExrChannel> channels =
      drawn.cutout ? render::exr_colours(*drawn.cutout, true) : render::exr_colours(drawn.image, false);
  for (const render::PixelData kind : s.options.data) {
    if (kind == render::PixelData::alpha) continue;
    for (ExrChannel& channel : render::exr_channels(kind, drawn.points, lens, s.subject.model))
      channels.push_back(std::move(channel));
  }
  std::filesystem::path path = png;
  path.replace_extension(".exr");
  write_file_atomically(path, bytes_of(encode_exr(lens.width, lens.height, channels)));
}

/// Writes a picture and its data. Returns the picture.
Image write_picture(Setting& s, const std::filesystem::path& png, const scene::Camera& camera) {
  Drawn drawn = drawn_picture(s, camera);
  write_png(png, drawn.image);
  if (s.options.exr)
    write_exr(s, png, drawn, s.lens(camera));
  else
    write_npy(s, png, drawn, s.lens(camera));
  return std::move(drawn.image);
}

void screenshot(Setting& s) {
  scene::Camera camera;
  if (s.options.camera || (!s.subject.cameras.empty() && !s.options.elevation))
    camera = s.camera(find_camera(s.subject, s.options.camera.value_or("0")));
  else
    camera = render::orbit(s.subject.framing, 1, s.elevation(), 0, s.size().x, s.size().y)[0];
  std::error_code none;
  if (std::filesystem::equivalent(*s.options.screenshot, s.subject.path, none))
    throw Error("{}: is the model itself; choose another name for the image", *s.options.screenshot);
  const std::filesystem::path picture(*s.options.screenshot);
  if (!picture.has_filename() || std::filesystem::is_directory(picture, none))
    throw Error("--screenshot {}: is a folder; add the name of a PNG file", *s.options.screenshot);
  const std::string ending = picture.extension().string();
  if (!ending.empty() && ending != ".png" && ending != ".PNG")
    throw Error("--screenshot {}: images are written as PNG; give a name that ends with .png", *s.options.screenshot);
  write_picture(s, *s.options.screenshot, camera);
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("{}: cannot be created ({}); choose another folder with -o", folder.string(), error.message());
}

/// Writes the views as pictures, as a video, or both.
void write_views(Setting& s, const FileCameras& views) {
  std::vector<scene::Camera> cameras = views.cameras;
  std::optional<Video> video;
  if (s.options.video) {
    // Pictures of a video have one size, and yuv420p needs even sides.
    const glm::ivec2 size(std::max(2, cameras[0].width & ~1), std::max(2, cameras[0].height & ~1));
    for (scene::Camera& camera : cameras)
      if (glm::ivec2(camera.width, camera.height) != size) camera = render::reshaped(camera, size.x, size.y);
    video.emplace(*s.options.video, size.x, size.y, views.fps);
  }
  const std::filesystem::path folder(s.options.output.value_or(""));
  if (s.options.output) make_folder(folder);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Image image = s.options.output ? write_picture(s, folder / fmt::format("{:05}.png", i), cameras[i])
                                         : s.renderer.picture(s.model, s.view(cameras[i]), s.draw);
    if (video) video->add(image);
  }
  if (video) video->finish();
}

std::vector<scene::Camera> path_cameras(const Setting& s) {
  if (*s.options.path == "orbit")
    return render::orbit(s.subject.framing, s.frames(), s.elevation(), 0, s.size().x, s.size().y);
  if (*s.options.path == "hemisphere") return render::hemisphere(s.subject.framing, s.frames(), s.size().x, s.size().y);
  std::vector<scene::Camera> cameras;
  for (std::size_t i = 0; i < s.subject.cameras.size(); ++i)
    if (!s.options.frames || !s.subject.cameras[i].test) cameras.push_back(s.camera(i));
  if (cameras.empty()) throw Error("--path cameras: {} has no cameras; give --dataset FOLDER", s.subject.path);
  if (s.options.frames) cameras = render::along(cameras, *s.options.frames);
  return cameras;
}

void path(Setting& s) { write_views(s, {path_cameras(s), s.options.fps.value_or(30)}); }

json statistics(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const auto quantile = [&](double q) {
    return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1) + 0.5)];
  };
  return {{"frames", ms.size()},
          {"mean_ms", std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size())},
          {"p50_ms", quantile(0.5)},
          {"p90_ms", quantile(0.9)},
          {"p99_ms", quantile(0.99)}};
}

void benchmark(Setting& s) {
  json result;
  result["device"] = s.gpu.info().name;
  result["driver"] = s.gpu.info().driver;
  result["model"] = utf8(s.subject.path);
  result["triangles"] = s.model.triangles;
  result["opaque"] = s.model.opaque;
  result["masked"] = s.model.masked;
  result["aa"] = to_string(s.draw.aa);
  std::vector<scene::Camera> cameras;
  for (std::size_t i = 0; i < s.subject.cameras.size(); ++i)
    cameras.push_back(render::reshaped(s.subject.cameras[i].camera, s.size().x, s.size().y));
  const std::vector<scene::Camera> sky = render::hemisphere(s.subject.framing, s.frames(), s.size().x, s.size().y);
  gpu::Graphics& graphics = *s.gpu.graphics();
  const gpu::Image target = graphics.create_image(
      {gpu::Format::rgba8, static_cast<std::uint32_t>(s.size().x), static_cast<std::uint32_t>(s.size().y)}, "picture");
  result["width"] = s.size().x;
  result["height"] = s.size().y;
  for (const auto& [name, views] :
       {std::pair<const char*, const std::vector<scene::Camera>*>("cameras", &cameras), {"hemisphere", &sky}}) {
    if (views->empty()) continue;
    std::vector<double> ms;
    const auto draw = [&](const scene::Camera& camera) {
      s.renderer.draw(s.model, s.view(camera), s.draw, target);
      s.gpu.wait();
    };
    for (std::size_t i = 0; i < std::min<std::size_t>(3, views->size()); ++i)
      draw((*views)[i]);  // warm-up: creates the pipelines
    s.gpu.reset_timings();
    s.gpu.enable_timings(true);
    for (const scene::Camera& camera : *views) {
      const auto start = std::chrono::steady_clock::now();
      draw(camera);
      ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    result[name] = statistics(ms);
    // Passes are named after their kernel or their last fragment shader.
    for (const auto& [pass, t] : s.gpu.timings())
      result[name]["passes_ms"][pass] = t.milliseconds / static_cast<double>(std::max<std::uint64_t>(1, t.launches));
    s.gpu.enable_timings(false);
  }
  result["shading"] = to_string(s.renderer.shading());
  const std::string text = result.dump(2) + "\n";
  check_output_is_not(s.options.json.value_or("-"), "--json", s.subject.path);
  write_output(s.options.json.value_or("-"), text);
}

/// Draws the views of --cameras.
void draw_file(Setting& s) {
  const FileCameras views =
      read_file_cameras(s.subject, *s.options.cameras, {s.options.dataparser, s.options.size, s.options.fps});
  if (views.distorted)
    std::fprintf(stderr, "soup-view: warning: %s: lenses are drawn without their distortion\n",
                 printable(*s.options.cameras).c_str());
  write_views(s, views);
}

}  // namespace

void run_headless(gpu::Device& gpu, const CommandLine& options, const Subject& subject) {
  Setting setting(gpu, options, subject);
  if (options.screenshot) screenshot(setting);
  if (options.path) path(setting);
  if (options.cameras) draw_file(setting);
  if (options.benchmark) benchmark(setting);
  const auto messages = gpu.validation_messages();
  if (!messages.empty()) throw Error("Vulkan validation: {}", messages.front());
}

}  // namespace trisoup::viewer
