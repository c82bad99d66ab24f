// Tests shaders/depth_gradient.comp: its vertex gradients against finite differences of the depth loss in double.
#include <catch2/catch.hpp>

#include <cmath>

#include "common/host.h"
#include "gpu/small_scene.h"
#include "scene/camera.h"

using namespace trisoup;

namespace {

constexpr std::uint32_t kWidth = 40, kHeight = 24, kMapWidth = 10, kMapHeight = 6;
constexpr double kWeight = 3;

/// Inverse depth of the map, linear in the picture, so that interpolation between its pixels is exact. u, v: 0 to 1.
double map_at(double u, double v) { return 1.1 + 0.15 * u - 0.1 * v; }

std::vector<float> map_of(bool hole) {
  std::vector<float> map;
  for (std::uint32_t y = 0; y < kMapHeight; ++y)
    for (std::uint32_t x = 0; x < kMapWidth; ++x)
      map.push_back(hole && x >= 5 ? 0.0f : static_cast<float>(map_at((x + 0.5) / kMapWidth, (y + 0.5) / kMapHeight)));
  return map;
}

/// Two large triangles that lie tilted in front of the camera, one to the left and one to the right.
std::vector<glm::vec3> corners() {
  const auto at = [](double right, double up, double towards) {
    const glm::dvec3 side(-std::sin(0.3), std::cos(0.3), 0), front(std::cos(0.3), std::sin(0.3), 0);
    return glm::vec3(right * side + glm::dvec3(0, 0, up) + towards * front);
  };
  return {at(-0.5, -0.4, 0.1), at(-0.02, -0.35, -0.05), at(-0.1, 0.4, 0.2),
          at(0.5, -0.4, 0.15), at(0.02, -0.3, 0.3),     at(0.1, 0.45, -0.1)};
}

/// The scene after its forward pass, with a depth map.
struct DepthScene {
  DepthScene(gpu::Device& device, const glm::dvec2& offset, bool hole)
      : gpu(device),
        map(gpu.allocate(4 * kMapWidth * kMapHeight, "map")),
        view(view_of(offset)),
        scene(gpu, 2, {{0, 0}}, {view}) {
    gpu.upload(map.address(), map_of(hole));
    gpu.upload(scene.soup.vertices.address(), corners());
    gpu.upload(scene.soup.source.address(), std::vector<float>(2 * 24, 2.0f));  // opaque
    scene.step.sum_textures();
    scene.inputs.depths = true;
  }

  train::BatchView view_of(const glm::dvec2& offset) {
    train::BatchView v = train::sampled_at(test::view_from(0.3, kWidth, kHeight), offset);
    v.depth = map.address(), v.depth_width = kMapWidth, v.depth_height = kMapHeight;
    return v;
  }

  /// Vertex gradients of the depth loss. masked: the left half of the picture is outside the loss.
  std::vector<double> gradients(double weight, bool masked = false) {
    train::Rates rates;
    rates.depth = weight;
    scene.step.begin(1, 0, 0, rates);
    scene.step.visibility(train::Thresholds::half, scene.inputs);
    std::vector<float> colour_gradient;
    for (std::uint32_t y = 0; y < kHeight; ++y)
      for (std::uint32_t x = 0; x < kWidth; ++x)
        colour_gradient.insert(colour_gradient.end(), {0, 0, 0, masked && x < kWidth / 2 ? -1.0f : 0.0f});
    gpu.upload(scene.buffers.gradient.address(), colour_gradient);
    scene.step.depth_gradient();
    const auto low = gpu.download_vector<std::uint32_t>(scene.soup.vertex_gradient.low.address(), 18);
    const auto high = gpu.download_vector<std::uint32_t>(scene.soup.vertex_gradient.high.address(), 18);
    std::vector<double> all;
    for (std::size_t i = 0; i < 18; ++i) all.push_back(train::fixed_sum(low[i], high[i]));
    return all;
  }

  gpu::Device& gpu;
  gpu::Buffer map;
  train::BatchView view;
  test::SmallScene scene;
};

/// The depth loss of the pixels that show a triangle, with its visible pixels held.
double loss_of(const DepthScene& s, const std::vector<kernels::Hit>& hits, const std::vector<glm::dvec3>& vertices,
               bool left, bool right) {
  const glm::dmat4 clip_from_world = s.view.clip_from_world;
  double loss = 0;
  for (std::uint32_t y = 0; y < kHeight; ++y)
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      const std::uint32_t triangle = hits[y * kWidth + x].triangle;
      if (triangle == 0 || !(x < kWidth / 2 ? left : right)) continue;
      const glm::dvec2 at = glm::dvec2(x + 0.5, y + 0.5) + s.view.offset, size(kWidth, kHeight);
      const glm::dvec4 p0 = clip_from_world * glm::dvec4(vertices[3 * (triangle - 1)], 1),
                       p1 = clip_from_world * glm::dvec4(vertices[3 * (triangle - 1) + 1], 1),
                       p2 = clip_from_world * glm::dvec4(vertices[3 * (triangle - 1) + 2], 1);
      const f64::PlanePoint point = f64::plane_point(p0, p1, p2, 2.0 * at / size - 1.0);
      // Half a pixel of the map at its border has no neighbour to interpolate with.
      const glm::dvec2 half(0.5 / kMapWidth, 0.5 / kMapHeight), uv = glm::clamp(at / size, half, 1.0 - half);
      loss += kWeight / (kWidth * kHeight) * f64::depth_loss(1 / point.w, map_at(uv.x, uv.y));
    }
  return loss;
}

void compare_with_differences(const glm::dvec2& offset) {
  auto gpu = test::open_device();
  DepthScene s(*gpu, offset, false);
  const std::vector<double> actual = s.gradients(kWeight);
  const auto hits = gpu->download_vector<kernels::Hit>(s.scene.buffers.hits.address(), kWidth * kHeight);
  std::vector<glm::dvec3> vertices;
  for (const glm::vec3& p : corners()) vertices.emplace_back(p);
  double largest = 0;
  for (std::size_t i = 0; i < 18; ++i) {
    double& x = vertices[i / 3][static_cast<int>(i % 3)];
    const double x0 = x, h = 1e-6;
    x = x0 + h;
    const double up = loss_of(s, hits, vertices, true, true);
    x = x0 - h;
    const double expected = (up - loss_of(s, hits, vertices, true, true)) / (2 * h);
    x = x0;
    largest = std::max(largest, std::abs(expected));
    CAPTURE(i);
    CHECK(actual[i] == Approx(expected).epsilon(2e-4).margin(2e-5));
  }
  CHECK(largest > 0.1);
  test::require_silence(*gpu);
}

}  // namespace

TEST_CASE("gradients of the depth loss match finite differences", "[depth][each_driver]") {
  compare_with_differences({0, 0});
}

TEST_CASE("gradients of the depth loss match finite differences off the centres of pixels", "[depth]") {
  compare_with_differences({0.25, -0.125});
}

TEST_CASE("masked pixels, unmeasured ones and a weight of 0 give no depth gradient", "[depth]") {
  auto gpu = test::open_device();
  const auto sum = [](const std::vector<double>& all, std::size_t first, std::size_t last) {
    double total = 0;
    for (std::size_t i = first; i < last; ++i) total += std::abs(all[i]);
    return total;
  };
  const std::vector<double> masked = DepthScene(*gpu, {}, false).gradients(kWeight, true);
  CHECK(sum(masked, 0, 9) == 0);  // the left triangle
  CHECK(sum(masked, 9, 18) > 0.1);
  const std::vector<double> unmeasured = DepthScene(*gpu, {}, true).gradients(kWeight);
  CHECK(sum(unmeasured, 0, 9) > 0.1);
  CHECK(sum(unmeasured, 9, 18) == 0);
  CHECK(sum(DepthScene(*gpu, {}, false).gradients(0), 0, 18) == 0);
}

TEST_CASE("a training with the depth loss moves surfaces to the measured depth", "[depth][same_code]") {
  auto gpu = test::open_device();
  DepthScene s(*gpu, {}, false);
  const auto error = [&] {
    s.scene.step.begin(1, 0, 0, {});
    s.scene.step.visibility(train::Thresholds::half, s.scene.inputs);
    const auto hits = gpu->download_vector<kernels::Hit>(s.scene.buffers.hits.address(), kWidth * kHeight);
    std::vector<glm::dvec3> vertices;
    for (const glm::vec3& p : gpu->download_vector<glm::vec3>(s.scene.soup.vertices.address(), 6))
      vertices.emplace_back(p);
    return loss_of(s, hits, vertices, true, true);
  };
  const double before = error();
  for (std::uint32_t i = 0; i < 200; ++i) {
    train::Rates rates = test::SmallScene::rates(i);
    rates.depth = 100 * kWeight, rates.vertex = 2e-3;  // much more than colours weigh
    s.scene.step.begin(1, i, 0, rates);
    s.scene.step.train(s.scene.inputs);
  }
  CHECK(error() < 0.1 * before);
}
