#include "bench_frames.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <span>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "args/soup.h"
#include "base/error.h"
#include "base/printable.h"
#include "cli/output_text.h"
#include "common/host.h"
#include "format/model_file.h"
#include "render/cameras.h"
#include "render/renderer.h"
#include "soup/atlas.h"

namespace trisoup {
namespace {

/// Appends a part of triangle t to `to`, with its texture resampled at the same level. corners: the barycentrics b0, b1
/// of the part's three corners in triangle t.
void add_part(const soup::Model& from, std::size_t t, const std::array<glm::vec2, 3>& corners, soup::Model& to) {
  const soup::TextureEntry row = from.textures[t];
  const int r = 1 << row.level_max;
  soup::TextureEntry part = row;
  part.lattice_offset = static_cast<std::uint32_t>(to.lattice.size() / soup::kChannels);
  for (const glm::vec2& b : corners)
    to.vertices.push_back(b.x * from.vertices[3 * t] + b.y * from.vertices[3 * t + 1] +
                          (1 - b.x - b.y) * from.vertices[3 * t + 2]);
  std::vector<std::uint8_t> lattice(std::size_t(soup::samples_at(row.level_max)) * soup::kChannels);
  soup::each_lattice_point(row.level_max, [&](int x, int y, std::uint32_t index) {
    const float u = float(x) / float(r), v = float(y) / float(r);
    const glm::vec2 b = u * corners[0] + v * corners[1] + (1 - u - v) * corners[2];
    const f32::LatticeCell cell = f32::lattice_cell(b.x, b.y, row.level_max);
    for (int c = 0; c < soup::kChannels; ++c) {
      const auto at = [&](std::uint32_t i) {
        return float(from.lattice[(std::size_t(row.lattice_offset) + i) * soup::kChannels + c]);
      };
      lattice[std::size_t(index) * soup::kChannels + c] =
          static_cast<std::uint8_t>(f32::lattice_mix(cell, at(cell.i0), at(cell.i1), at(cell.i2)) + 0.5f);
    }
  });
  to.lattice.insert(to.lattice.end(), lattice.begin(), lattice.end());
  to.textures.push_back(part);
}

/// Returns a soup of about `count` triangles that looks like the model. Splits some triangles in four, or keeps a
/// subset enlarged to the same total area.
soup::Model with_triangles(const soup::Model& model, std::size_t count) {
  soup::Model now = model;
  while (now.triangles() < count) {
    soup::Model next = now;
    next.vertices.clear();
    next.textures.clear();
    next.lattice.clear();
    const std::size_t split = std::min(now.triangles(), (count - now.triangles() + 2) / 3);
    constexpr glm::vec2 a{1, 0}, b{0, 1}, c{0, 0}, ab{0.5f, 0.5f}, bc{0, 0.5f}, ca{0.5f, 0};
    for (std::size_t t = 0; t < now.triangles(); ++t) {
      // Spreads the split triangles evenly over the soup.
      if ((t + 1) * split / now.triangles() == t * split / now.triangles()) {
        add_part(now, t, {a, b, c}, next);
      } else {
        for (const auto& part : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
          add_part(now, t, part, next);
      }
    }
    now = std::move(next);
  }
  if (now.triangles() > count) {
    soup::Model next = now;
    next.vertices.clear();
    next.textures.clear();
    const float grow = std::sqrt(float(now.triangles()) / float(count));
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t t = i * now.triangles() / count;
      const glm::vec3 middle = (now.vertices[3 * t] + now.vertices[3 * t + 1] + now.vertices[3 * t + 2]) / 3.0f;
      for (int k = 0; k < 3; ++k) next.vertices.push_back(middle + grow * (now.vertices[3 * t + k] - middle));
      next.textures.push_back(now.textures[t]);
    }
    now = std::move(next);
  }
  return now;
}

/// The passes of the published viewer, with the atlas and the MLP of this project.
class Published {
 public:
  Published(gpu::Device& gpu, const soup::Model& model, const render::GpuModel& ours)
      : gpu_(gpu), graphics_(*gpu.graphics()), model_(ours) {
    std::vector<std::uint32_t> levels;
    for (const soup::TextureEntry& row : model.textures) levels.push_back(row.level_max);
    const soup::Atlas atlas =
        soup::make_atlas(levels, std::min<int>(soup::kAtlasSide, static_cast<int>(graphics_.max_side())));
    gpu::ImageShape shape = ours.features.shape();
    shape.layers /= 2;
    for (int half = 0; half < 2; ++half) {
      textures_[half] = graphics_.create_image(shape, "features");
      std::vector<std::uint8_t> page(std::size_t(shape.width) * shape.height * 4);
      for (std::uint32_t layer = 0; layer < shape.layers; ++layer) {
        for (std::size_t t = 0; t < model.triangles(); ++t)
          if (atlas.places[t].page == layer)
            soup::each_lattice_point(atlas.places[t].level, [&](int x, int y, std::uint32_t index) {
              const glm::ivec2 texel = soup::atlas_texel(atlas.places[t], x, y);
              std::copy_n(
                  &model.lattice[(std::size_t(model.textures[t].lattice_offset) + index) * soup::kChannels + 4 * half],
                  4, &page[(std::size_t(texel.y) * shape.width + texel.x) * 4]);
            });
        graphics_.upload(textures_[half], layer, std::as_bytes(std::span(page)));
      }
    }
    struct Vertex {
      glm::vec4 position;
      glm::uvec4 record;
    };
    std::vector<Vertex> corners;
    const std::vector<glm::vec3> vertices = soup::normalised_vertices(model);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const soup::AtlasPlace& place = atlas.places[i / 3];
      corners.push_back({glm::vec4(vertices[i], 1.0f),
                         {place.x0 | std::uint32_t(place.y0) << 16,
                          place.level | std::uint32_t(place.page) << 8 | std::uint32_t(place.turned) << 16, 0, 0}});
    }
    corners_ = gpu.allocate(corners.size() * sizeof(Vertex), "triangles");
    gpu.upload(corners_.address(), corners);
    frame_ = gpu.allocate(sizeof(kernels::DrawFrame), "frame");
  }

  void draw(const render::View& view, const glm::vec3& background, const gpu::Image& target) {
    if (!depth_ || depth_.shape().width != view.width || depth_.shape().height != view.height) {
      depth_ = graphics_.create_image({gpu::Format::depth32, view.width, view.height}, "depth");
      for (gpu::Image& image : targets_)
        image = graphics_.create_image({gpu::Format::rgba8, view.width, view.height}, "features");
    }
    const scene::PixelRays rays = scene::pixel_rays(glm::inverse(view.clip_from_world));
    kernels::DrawFrame frame{};
    frame.clip_from_world = glm::mat4(view.clip_from_world);
    frame.ray = glm::vec4(rays.centre, 0.0);
    frame.ray_x = glm::vec4(rays.x, 0.0);
    frame.ray_y = glm::vec4(rays.y, 0.0);
    frame.background = glm::vec4(background, 1.0f);
    frame.pixel_x = 2.0f / static_cast<float>(view.width);
    frame.pixel_y = 2.0f / static_cast<float>(view.height);
    gpu_.upload(frame_.address(), std::as_bytes(std::span(&frame, 1)));
    // One list of all triangles: these passes do not treat opaque ones separately.
    gpu::Draw first{.vertex = "published", .fragment = "both_textures"};
    first.depth = gpu::Depth::nearest;
    first.vertices = corners_.address();
    first.vertex_vectors = 2;
    first.count = static_cast<std::uint32_t>(3 * model_.triangles);
    first.textures = {&textures_[0], &textures_[1]};
    first.uniforms = {{model_.mlp.address(), model_.mlp.bytes()}, {frame_.address(), frame_.bytes()}};
    graphics_.draw({.colour = {&targets_[0], &targets_[1]}, .depth = &depth_}, first);

    gpu::Draw second{.vertex = "screen", .fragment = "shade_published_fixed"};
    second.constants = {0};
    second.constants.insert(second.constants.end(), model_.mlp_constants.begin(), model_.mlp_constants.end());
    second.count = 3;
    second.textures = {&targets_[0], &model_.table, &model_.features, &targets_[1]};
    second.uniforms = first.uniforms;
    gpu::Targets to{.colour = {&target}};
    graphics_.draw(to, second);
  }

 private:
  gpu::Device& gpu_;
  gpu::Graphics& graphics_;
  const render::GpuModel& model_;
  std::array<gpu::Image, 2> textures_, targets_;
  gpu::Image depth_;
  gpu::Buffer corners_, frame_;
};

/// Returns how a renderer with this setting shades. Measures it first if no result is cached.
render::Shading shading_of(gpu::Device& gpu, render::Shading asked, const render::GpuModel& model,
                           const render::Framing& framing) {
  render::Renderer renderer(gpu, asked);
  renderer.picture(model, render::view_of(render::hemisphere(framing, 1, 1280, 720)[0], 0.025, 2.5), {});
  return renderer.shading();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Returns the median frame times in ms: fragment shading, compute shading, msaa, ssaa, published. renderers: one for
/// each of the first four.
std::array<double, 5> frame_times(gpu::Device& gpu, std::span<render::Renderer, 4> renderers, Published& published,
                                  const render::GpuModel& gpu_model, const std::vector<scene::Camera>& views,
                                  render::DrawOptions draw, const gpu::Image& target) {
  std::array<std::vector<double>, 5> times;
  const auto timed = [&](std::size_t which, bool count, const std::function<void()>& record) {
    const auto start = std::chrono::steady_clock::now();
    record();
    gpu.wait();
    if (count)
      times[which].push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  };
  // All variants draw each view in turn, so that other load on the machine affects them alike. The first view
  // creates the pipelines.
  for (std::size_t i = 0; i <= views.size(); ++i) {
    const render::View view = render::view_of(views[i % views.size()], 0.025, 2.5);
    for (std::size_t which = 0; which < 4; ++which)
      timed(which, i > 0, [&] {
        using render::AntiAliasing;
        draw.aa = std::array{AntiAliasing::none, AntiAliasing::none, AntiAliasing::msaa, AntiAliasing::ssaa}[which];
        renderers[which].draw(gpu_model, view, draw, target);
      });
    timed(4, i > 0, [&] { published.draw(view, draw.background, target); });
  }
  std::array<double, 5> ms;
  std::transform(times.begin(), times.end(), ms.begin(), median);
  return ms;
}

}  // namespace

void bench_frames(gpu::Device& gpu, const FramesOptions& options) {
  const soup::ModelFile file = soup::read_model(options.model);
  std::FILE* const out = text_stream(options.json);
  std::fprintf(out, "%s\n%s: frame times in ms, medians of %d views of the upper hemisphere\n", gpu.info().name.c_str(),
               options.model.c_str(), options.repeats);
  std::fprintf(out, "%10s %10s %10s %10s %10s %10s %10s %10s %8s\n", "triangles", "size", "ours by", "fragment",
               "compute", "msaa", "ssaa", "published", "ratio");
  nlohmann::json rows = nlohmann::json::array();
  // Fragment shading, compute shading, msaa, ssaa. One renderer each, because they keep images of different sizes.
  std::array<render::Renderer, 4> renderers{render::Renderer(gpu, render::Shading::fragment),
                                            render::Renderer(gpu, render::Shading::compute), render::Renderer(gpu),
                                            render::Renderer(gpu)};
  for (const std::size_t triangles : {1000u, 5000u, 15000u, 60000u}) {
    const soup::Model model = with_triangles(file.model, triangles);
    const render::GpuModel gpu_model = render::upload_model(gpu, model);
    Published published(gpu, model, gpu_model);
    std::vector<scene::Camera> cameras;
    for (const soup::ModelCamera& c : file.cameras) cameras.push_back(c.camera);
    const render::Framing framing =
        render::frame(soup::normalised_vertices(file.model), cameras, file.up.value_or(render::mean_up(cameras)));
    const render::Shading shading = shading_of(gpu, options.shading, gpu_model, framing);
    for (const glm::ivec2 size : {glm::ivec2(1920, 1080), {1280, 720}, {960, 540}}) {
      const gpu::Image target = gpu.graphics()->create_image(
          {gpu::Format::rgba8, static_cast<std::uint32_t>(size.x), static_cast<std::uint32_t>(size.y)}, "picture");
      render::DrawOptions draw;
      draw.background = model.background;
      const std::vector<scene::Camera> views = render::hemisphere(framing, options.repeats, size.x, size.y);
      const std::array<double, 5> ms = frame_times(gpu, renderers, published, gpu_model, views, draw, target);
      const double ours = shading == render::Shading::compute ? ms[1] : ms[0];
      std::fprintf(out, "%10zu %10s %10s %10.2f %10.2f %10.2f %10.2f %10.2f %8.2f\n", model.triangles(),
                   fmt::format("{}x{}", size.x, size.y).c_str(), render::to_string(shading), ms[0], ms[1], ms[2], ms[3],
                   ms[4], ms[4] / ours);
      std::fflush(out);
      rows.push_back({{"triangles", model.triangles()},
                      {"width", size.x},
                      {"height", size.y},
                      {"shading", render::to_string(shading)},
                      {"ms", ours},
                      {"fragment_ms", ms[0]},
                      {"compute_ms", ms[1]},
                      {"msaa_ms", ms[2]},
                      {"ssaa_ms", ms[3]},
                      {"published_ms", ms[4]}});
    }
  }
  const nlohmann::json result{{"device", gpu.info().name}, {"model", utf8(options.model)}, {"frames", rows}};
  if (!options.json.empty()) write_output(options.json, result.dump(2) + "\n");
}

}  // namespace trisoup
