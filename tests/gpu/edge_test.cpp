// Tests shaders/edge_forces.comp: with constant colours, its vertex gradients must match those of a supersampled image.
#include <catch2/catch.hpp>

#include <cmath>

#include "args/edge_forces.h"
#include "common/host.h"
#include "gpu/small_scene.h"

using namespace trisoup;

namespace {

constexpr std::uint32_t kSide = 32;
constexpr int kSub = 12;  // supersamples per pixel and axis

struct Flat {  // a triangle of one colour, its opacity linear between the corners
  glm::dvec3 corner[3];
  double colour, opacity[3];
};

/// Weight of a pixel's colour in the loss. It is smooth, so that the sampling position within a pixel does not matter.
/// It is a product of functions of column and row, because a supersampled image needs each of them a thousand times.
double weight_of_column(double x) { return 1e-3 * (1.0 + 0.5 * std::sin(0.15 * x)); }
double weight_of_row(double y) { return 1e-3 * 0.3 * std::cos(0.1 * y); }
double weight(double x, double y) { return weight_of_column(x) + weight_of_row(y); }

double supersampled_loss(const std::vector<Flat>& scene, const glm::dmat4& clip_from_world, double background) {
  std::vector<std::array<glm::dvec4, 3>> clip;
  for (const Flat& t : scene)
    clip.push_back({clip_from_world * glm::dvec4(t.corner[0], 1), clip_from_world * glm::dvec4(t.corner[1], 1),
                    clip_from_world * glm::dvec4(t.corner[2], 1)});
  const auto place = [](std::uint32_t sample) { return (sample + 0.5) / kSub - 0.5; };
  std::array<double, kSide * kSub> columns;
  for (std::uint32_t x = 0; x < kSide * kSub; ++x) columns[x] = weight_of_column(place(x));
  double loss = 0;
  for (std::uint32_t y = 0; y < kSide * kSub; ++y) {
    const double row = weight_of_row(place(y));
    for (std::uint32_t x = 0; x < kSide * kSub; ++x) {
      const glm::dvec2 ndc = f64::pixel_ndc(x, y, kSide * kSub, kSide * kSub);
      double nearest = 2, colour = background;
      for (std::size_t t = 0; t < scene.size(); ++t) {
        const f64::PlanePoint p = f64::plane_point(clip[t][0], clip[t][1], clip[t][2], ndc);
        const Flat& f = scene[t];
        if (!p.inside || p.depth < -1 || p.depth >= nearest ||
            p.b0 * f.opacity[0] + p.b1 * f.opacity[1] + p.b2 * f.opacity[2] < 0.5)
          continue;
        nearest = p.depth;
        colour = f.colour;
      }
      loss += 3 * (columns[x] + row) * colour / (kSub * kSub);
    }
  }
  return loss;
}

float logit(double v) { return static_cast<float>(std::log(v / (1 - v))); }

/// Compares the kernel's gradients with the true ones over several random scenes. Returns the slope by least squares
/// and the correlation. Vertices move along the screen axes or, with along_depth, along the viewing direction.
void compare(const std::function<std::vector<Flat>(soup::Random&)>& make, bool along_depth, double& slope,
             double& correlation, std::uint64_t scenes = 8) {
  auto gpu = test::open_device();
  double ab = 0, aa = 0, bb = 0;
  for (std::uint64_t seed = 0; seed < scenes; ++seed) {
    soup::Random random(seed + 11);
    std::vector<Flat> scene = make(random);
    const auto triangles = static_cast<std::uint32_t>(scene.size());
    test::SmallScene s(*gpu, triangles, {{0, 0}}, {test::view_from(0.3, kSide, kSide)});
    std::vector<float> logits(triangles * 24);
    std::vector<glm::vec3> vertices;
    for (std::uint32_t t = 0; t < triangles; ++t)
      for (int k = 0; k < 3; ++k) {
        // Sample 0 of level 0 belongs to vertex 2, 1 to vertex 0, 2 to vertex 1.
        float* sample = &logits[(t * 3 + (k + 1) % 3) * 8];
        for (int c = 0; c < 3; ++c) sample[c] = logit(scene[t].colour);
        sample[3] = logit(1e-7);
        sample[7] = logit(scene[t].opacity[k]);
        vertices.emplace_back(scene[t].corner[k]);
        scene[t].corner[k] = glm::dvec3(vertices.back());
      }
    gpu->upload(s.soup.source.address(), logits);
    gpu->upload(s.soup.vertices.address(), vertices);
    const double background = 0.95;
    s.inputs.background = glm::vec3(static_cast<float>(background));
    s.step.sum_textures();
    s.step.begin(1, 0, 0, {});
    s.step.visibility(train::Thresholds::half, s.inputs);
    s.step.shade(s.inputs);
    std::vector<float> gradient;
    for (std::uint32_t y = 0; y < kSide; ++y)
      for (std::uint32_t x = 0; x < kSide; ++x) {
        const float w = static_cast<float>(weight(x, y));
        gradient.insert(gradient.end(), {w, w, w, 0.0f});
      }
    gpu->upload(s.buffers.gradient.address(), gradient);
    gpu->launch({"edge_forces", {0}}, s.buffers.batch().tiles,
                kernels::EdgeForcesArgs{s.buffers.views.address(), s.buffers.hits.address(), s.buffers.screen.address(),
                                        s.buffers.colour.address(), s.buffers.gradient.address(),
                                        s.soup.vertex_gradient.low.address(), s.soup.vertex_gradient.high.address(),
                                        s.buffers.batch().tiles, 1, triangles, 0});
    const auto low = gpu->download_vector<std::uint32_t>(s.soup.vertex_gradient.low.address(), triangles * 9);
    const auto high = gpu->download_vector<std::uint32_t>(s.soup.vertex_gradient.high.address(), triangles * 9);
    const glm::dmat4 clip_from_world = s.views[0].clip_from_world;
    const glm::dvec3 forward(-std::cos(0.3), -std::sin(0.3), 0);
    std::vector<glm::dvec3> axes{forward};
    if (!along_depth) axes = {glm::cross(glm::dvec3(0, 0, -1), forward), {0, 0, 1}};
    for (std::uint32_t t = 0; t < triangles; ++t)
      for (int k = 0; k < 3; ++k)
        for (const glm::dvec3& axis : axes) {
          double actual = 0;
          for (int i = 0; i < 3; ++i) {
            const std::size_t at = (t * 3 + k) * 3 + i;
            actual += axis[i] * train::fixed_sum(low[at], high[at]);
          }
          const double h = 0.01;
          std::vector<Flat> moved = scene;
          moved[t].corner[k] += h * axis;
          const double up = supersampled_loss(moved, clip_from_world, background);
          moved[t].corner[k] -= 2 * h * axis;
          const double expected = (up - supersampled_loss(moved, clip_from_world, background)) / (2 * h);
          ab += actual * expected;
          aa += actual * actual;
          bb += expected * expected;
        }
  }
  slope = ab / bb;
  correlation = ab / std::sqrt(aa * bb);
  test::require_silence(*gpu);
}

glm::dvec3 in_picture(soup::Random& random, double depth) {
  const glm::dvec3 side(-std::sin(0.3), std::cos(0.3), 0), towards(std::cos(0.3), std::sin(0.3), 0);
  return side * double(random.uniform(-0.3f, 0.3f)) + glm::dvec3(0, 0, double(random.uniform(-0.3f, 0.3f))) +
         towards * depth;
}

}  // namespace

TEST_CASE("gradients of silhouettes match a supersampled image", "[edges]") {
  double slope = 0, correlation = 0;
  compare(
      [](soup::Random& r) {
        Flat t{{in_picture(r, 0), in_picture(r, 0.1), in_picture(r, -0.1)}, 0.2, {0.9, 0.9, 0.9}};
        return std::vector<Flat>{t};
      },
      false, slope, correlation);
  CAPTURE(slope, correlation);
  CHECK(slope == Approx(1).margin(0.05));
  CHECK(correlation > 0.98);
}

TEST_CASE("gradients of silhouettes match a supersampled image for triangles that reach behind the camera", "[edges]") {
  double slope = 0, correlation = 0;
  compare(
      [](soup::Random& r) {
        // The camera is at depth 1. The triangles pass beside it, so that the near plane clips them outside the image.
        const glm::dvec3 side(-std::sin(0.3), std::cos(0.3), 0), towards(std::cos(0.3), std::sin(0.3), 0);
        // One random number per statement: the order of evaluation within a statement depends on the compiler.
        const double left = r.uniform01() < 0.5f ? -1 : 1, aside = r.uniform(0.8f, 1.6f),
                     behind = r.uniform(1.3f, 2.5f);
        Flat t{{in_picture(r, 0), in_picture(r, -0.3), left * aside * side + behind * towards}, 0.2, {0.9, 0.9, 0.9}};
        return std::vector<Flat>{t};
      },
      false, slope, correlation, 32);
  CAPTURE(slope, correlation);
  CHECK(slope == Approx(1).margin(0.05));
  CHECK(correlation > 0.98);
}

TEST_CASE("gradients of opacity edges match a supersampled image", "[edges]") {
  double slope = 0, correlation = 0;
  compare(
      [](soup::Random& r) {
        Flat t{{in_picture(r, 0), in_picture(r, 0.1), in_picture(r, -0.1)}, 0.2, {0.9, 0.2, 0.7}};
        return std::vector<Flat>{t};
      },
      false, slope, correlation);
  CAPTURE(slope, correlation);
  CHECK(slope == Approx(1).margin(0.07));
  CHECK(correlation > 0.97);
}

namespace {

/// Two planes that fill the image and intersect in it. There are no other edges.
std::vector<Flat> crossing_planes(soup::Random& r, double steepness) {
  const glm::dvec3 side(-std::sin(0.3), std::cos(0.3), 0), up(0, 0, 1), towards(std::cos(0.3), std::sin(0.3), 0);
  const auto plane = [&](double colour) {
    const auto depth = [&] { return steepness * double(r.uniform(-1.0f, 1.0f)) * towards; };
    return Flat{{-2.0 * side - 1.2 * up + depth(), 2.0 * side - 1.2 * up + depth(), 2.4 * up + depth()},
                colour,
                {0.9, 0.9, 0.9}};
  };
  return {plane(0.2), plane(0.6)};
}

}  // namespace

TEST_CASE("gradients of intersections along the screen axes match a supersampled image", "[edges]") {
  double slope = 0, correlation = 0;
  compare([](soup::Random& r) { return crossing_planes(r, 0.3); }, false, slope, correlation);
  CAPTURE(slope, correlation);
  CHECK(slope == Approx(1).margin(0.1));
  CHECK(correlation > 0.97);
}

TEST_CASE("gradients of intersections along depth are twice those of a supersampled image", "[edges]") {
  double slope = 0, correlation = 0;
  compare([](soup::Random& r) { return crossing_planes(r, 0.2); }, true, slope, correlation);
  CAPTURE(slope, correlation);
  // The published estimator, which the kernel implements, counts motion along depth twice: pairs of pixels along x see
  // all of it, and pairs along y see all of it again. Motion along x affects only pairs along x.
  CHECK(slope == Approx(2).margin(0.25));
  CHECK(correlation > 0.95);
}
