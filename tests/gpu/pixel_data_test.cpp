// Tests render/pixel_data.h with the pictures of the renderer.
#include <catch2/catch.hpp>

#include <cmath>
#include <span>

#include "args/fetch_features.h"
#include "gpu/small_scene.h"
#include "image/npy_file.h"
#include "render/cameras.h"
#include "render/pixel_data.h"
#include "render/renderer.h"
#include "train/quality/evaluate.h"
#include "train/quality/evaluate_renderer.h"
#include "viewer/pick.h"

using namespace trisoup;
using render::PixelData;

namespace {

/// A random soup in dataset coordinates that are twice the normalised ones, and moved.
soup::Model moved_model(gpu::Device& gpu) {
  test::SmallScene scene(gpu, 40, {{0, 0}, {2, 5}, {1, 3}, {5, 5}, {0, 1}, {2, 4}}, {test::view_from(0, 16, 16)});
  soup::Model model = train::make_model(gpu, scene.soup, glm::vec3(1.0f, 0.5f, 0.25f), {});
  for (glm::vec3& v : model.vertices) v = 2.0f * v + glm::vec3(3, 4, 5);
  model.centre = {3, 4, 5};
  model.scale = 0.5;
  return model;
}

ValueMap decoded(PixelData kind, const std::vector<render::SurfacePoint>& points, const scene::Camera& camera,
                 const soup::Model& model) {
  const std::string bytes = render::npy_of(kind, points, camera, model);
  return decode_npy(std::as_bytes(std::span(bytes)), "data");
}

struct Drawn {
  soup::Model model;
  scene::Camera camera = render::look_at({0.9, -0.5, 0.3}, {0, 0, 0}, {0, 0, 1}, 0.4, 120, 90);
  Image black, white;
  std::vector<std::uint32_t> hits;

  Drawn() {
    auto gpu = test::open_device();
    model = moved_model(*gpu);
    camera.cx += 7;
    const render::GpuModel uploaded = render::upload_model(*gpu, model);
    render::Renderer renderer(*gpu);
    const render::View view = render::view_of(camera, 0.025, 2.5);
    render::DrawOptions options{.aa = render::AntiAliasing::msaa, .background = glm::vec3(1.0f)};
    white = renderer.picture(uploaded, view, options);
    options.background = glm::vec3(0.0f);
    black = renderer.picture(uploaded, view, options);
    options.aa = render::AntiAliasing::none;
    renderer.picture(uploaded, view, options);
    hits = renderer.hits();
    test::require_silence(*gpu);
  }
};

}  // namespace

TEST_CASE("a pixel's numbers are those of its ray's nearest intersection", "[renderer][pixel_data]") {
  const Drawn drawn;
  const auto& [model, camera, black, white, hits] = drawn;
  const std::vector<render::SurfacePoint> points = render::surface_points(model, camera, hits);
  const ValueMap depth = decoded(PixelData::depth, points, camera, model),
                 ray_depth = decoded(PixelData::ray_depth, points, camera, model),
                 triangle = decoded(PixelData::triangle, points, camera, model);
  REQUIRE(depth.width == 120);
  REQUIRE(depth.height == 90);
  REQUIRE(points.size() == 120u * 90u);
  // In dataset coordinates.
  const glm::dvec3 eye = camera.centre() / model.scale + model.centre;
  std::size_t seen = 0, empty = 0, differ = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec2 pixel(static_cast<double>(i % 120) + 0.5, static_cast<double>(i / 120) + 0.5);
    const auto nearest = viewer::surface_point(model, camera, pixel, 0.025, 2.5, false);
    if (triangle.values[i] < 0) {
      ++empty;
      CHECK(std::isinf(depth.values[i]));
      CHECK(std::isinf(ray_depth.values[i]));
      differ += nearest ? 1 : 0;
      continue;
    }
    ++seen;
    const glm::dvec3 expected = nearest ? *nearest / model.scale + model.centre : glm::dvec3(1e9);
    const double along = glm::dot(expected - eye, camera.forward()), away = glm::length(expected - eye);
    // The rasteriser may decide otherwise at edges.
    if (std::abs(depth.values[i] - along) > 1e-4 * along || std::abs(ray_depth.values[i] - away) > 1e-4 * away)
      ++differ;
  }
  CAPTURE(seen, empty, differ);
  CHECK(seen > 2000);
  CHECK(empty > 500);
  CHECK(differ * 200 <= points.size());
}

TEST_CASE("barycentrics and normals belong to the vertices of the named triangle", "[renderer][pixel_data]") {
  const Drawn drawn;
  const auto& [model, camera, black, white, hits] = drawn;
  const glm::dvec3 eye = camera.centre() / model.scale + model.centre;
  const std::vector<render::SurfacePoint> points = render::surface_points(model, camera, hits);
  std::size_t off = 0, seen = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const render::SurfacePoint& p = points[i];
    if (p.triangle < 0) continue;
    ++seen;
    const glm::vec3* const corners = &model.vertices[3 * static_cast<std::size_t>(p.triangle)];
    const auto& b = p.barycentrics;
    CHECK(b[0] + b[1] + b[2] == Approx(1));
    // The point that the weights give is shown in this pixel.
    const glm::dvec3 place = double(b[0]) * glm::dvec3(corners[0]) + double(b[1]) * glm::dvec3(corners[1]) +
                             double(b[2]) * glm::dvec3(corners[2]);
    const auto shown = scene::shown_at(camera, model.scale * (place - model.centre));
    const glm::dvec2 pixel(static_cast<double>(i % 120) + 0.5, static_cast<double>(i / 120) + 0.5);
    if (!shown || glm::length(shown->pixel - pixel) > 1e-2) ++off;
    CHECK(glm::length(p.normal) == Approx(1).epsilon(1e-5));
    CHECK(std::abs(glm::dot(p.normal, glm::normalize(corners[1] - corners[0]))) < 1e-4f);
    CHECK(std::abs(glm::dot(p.normal, glm::normalize(corners[2] - corners[0]))) < 1e-4f);
    CHECK(glm::dot(glm::dvec3(p.normal), eye - place) >= -1e-5);
  }
  CAPTURE(seen, off);
  CHECK(off * 200 <= seen);
}

TEST_CASE("features of pixels are those that the kernels give to the MLP", "[renderer][pixel_data]") {
  const Drawn drawn;
  const auto& [model, camera, black, white, hits] = drawn;
  const std::vector<render::SurfacePoint> points = render::surface_points(model, camera, hits);
  auto gpu = test::open_device();
  const train::SoupBuffers soup = train::load_model(*gpu, model, {model.centre, model.scale});
  std::vector<kernels::Hit> of_kernels;
  for (const render::SurfacePoint& p : points)
    of_kernels.push_back({static_cast<std::uint32_t>(p.triangle + 1), p.barycentrics[0], p.barycentrics[1], 0});
  const auto pixels = static_cast<std::uint32_t>(points.size());
  const gpu::Buffer hit_buffer = gpu->allocate(pixels * sizeof(kernels::Hit), "hits");
  const gpu::Buffer feature_buffer = gpu->allocate(32ull * pixels, "features");
  gpu->upload(hit_buffer.address(), of_kernels);
  gpu->launch({"fetch_features"}, (pixels + 63) / 64,
              kernels::FetchFeaturesArgs{hit_buffer.address(), soup.textures.address(), soup.lattice.address(),
                                         feature_buffer.address(), pixels, 0,
                                         static_cast<std::uint32_t>(model.triangles()), 0});
  const auto wanted = gpu->download_vector<float>(feature_buffer.address(), 8 * std::uint64_t(pixels));
  const std::vector<float> values = render::values_of(PixelData::features, points, camera, model);
  std::size_t seen = 0, off = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].triangle < 0) continue;
    ++seen;
    for (std::size_t c = 0; c < 7; ++c) off += std::abs(values[8 * i + c] - wanted[8 * i + c]) > 1e-6f;
    off += values[8 * i + 7] < 0.5f - 1e-4f;  // visible
  }
  CAPTURE(seen);
  CHECK(seen > 2000);
  CHECK(off * 200 <= seen);
  test::require_silence(*gpu);
}

TEST_CASE("a transparent picture gives both backgrounds back", "[renderer][pixel_data]") {
  const Drawn drawn;
  const Image image = render::transparent(drawn.black, drawn.white);
  std::size_t whole = 0, none = 0, part = 0;
  int most = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const int alpha = image.rgba[i + 3];
    ++(alpha == 255 ? whole : alpha == 0 ? none : part);
    for (std::size_t c = 0; c < 3; ++c) {
      const double colour = image.rgba[i + c] * alpha / 255.0;
      most = std::max(most, static_cast<int>(std::ceil(std::abs(colour - drawn.black.rgba[i + c]) - 1e-9)));
      most =
          std::max(most, static_cast<int>(std::ceil(std::abs(colour + 255 - alpha - drawn.white.rgba[i + c]) - 1e-9)));
    }
  }
  CAPTURE(whole, none, part);
  CHECK(whole > 1000);
  CHECK(none > 500);
  CHECK(part > 50);
  // Both pictures and the colour are rounded, by up to half each, and so is their difference.
  CHECK(most <= 2);
}
