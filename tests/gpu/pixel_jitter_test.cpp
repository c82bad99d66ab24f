// Tests pixel jitter, which samples away from pixel centres: train::sampled_at, train::pixel_jitter and
// shaders/sample_photographs.comp.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "gpu/small_scene.h"

using namespace trisoup;
using test::SmallScene;

namespace {

struct Picture {
  std::vector<kernels::Hit> hits;
  std::vector<float> colour;  // [pixels][3]
};

Picture picture_of(SmallScene& s, const train::BatchView& view) {
  s.buffers.set_batch(std::span(&view, 1), s.soup.triangles, true);
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  s.step.shade(s.inputs);
  const std::uint32_t pixels = s.buffers.batch().pixels;
  return {s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), pixels),
          s.gpu.download_vector<float>(s.buffers.colour.address(), 3ull * pixels)};
}

/// The target images of these views in the loss, RGBA8.
std::vector<std::uint32_t> targets(SmallScene& s, std::span<const train::BatchView> views) {
  s.buffers.set_batch(views, s.soup.triangles, true);
  s.inputs.target = 0;
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  s.step.shade(s.inputs);
  s.step.loss(s.inputs);
  return s.gpu.download_vector<std::uint32_t>(s.buffers.target.address(), s.buffers.batch().pixels);
}

gpu::Buffer upload(gpu::Device& gpu, const std::vector<std::uint32_t>& photograph) {
  gpu::Buffer buffer = gpu.allocate(photograph.size() * 4, "photograph");
  gpu.upload(buffer.address(), photograph);
  return buffer;
}

int channel(std::uint32_t rgba, int c) { return static_cast<int>((rgba >> (8 * c)) & 255u); }

std::vector<std::uint32_t> noise(std::uint32_t width, std::uint32_t height, std::uint64_t seed) {
  soup::Random random(seed);
  std::vector<std::uint32_t> photograph(std::size_t(width) * height);
  for (std::uint32_t& p : photograph) p = random.bits() | 0xff000000u;
  return photograph;
}

}  // namespace

TEST_CASE("jittered renderings match the pixels of a larger rendering", "[jitter]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kWidth = 48, kHeight = 36;
  SmallScene s(*gpu, 40, {{0, 3}}, {test::view_from(0.7, kWidth, kHeight)});
  // Each pixel corresponds to four pixels of the larger image, with centres a quarter of a pixel off its own.
  const Picture large = picture_of(s, test::view_from(0.7, 2 * kWidth, 2 * kHeight));
  for (const int right : {0, 1})
    for (const int below : {0, 1}) {
      const Picture small = picture_of(s, train::sampled_at(s.views[0], {0.5 * right - 0.25, 0.5 * below - 0.25}));
      std::size_t seen = 0, others = 0;
      for (std::uint32_t y = 0; y < kHeight; ++y)
        for (std::uint32_t x = 0; x < kWidth; ++x) {
          const std::size_t p = y * kWidth + x, q = (2 * y + below) * 2 * kWidth + 2 * x + right;
          seen += small.hits[p].triangle != 0;
          if (small.hits[p].triangle != large.hits[q].triangle) {
            ++others;
            continue;
          }
          for (int c = 0; c < 3; ++c) CHECK(small.colour[3 * p + c] == Approx(large.colour[3 * q + c]).margin(1e-3));
        }
      CAPTURE(right, below, seen);
      CHECK(seen > 300);
      CHECK(others <= 2);  // pixels with the centre exactly on an edge
    }
  test::require_silence(*gpu);
}

TEST_CASE("photographs are sampled at the same positions as the soup", "[jitter]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kWidth = 40, kHeight = 30;
  SmallScene s(*gpu, 1, {{4, 4}}, {test::view_from(0, kWidth, kHeight)});
  // One triangle covers the image, with a smooth texture. A rendering of the soup is used as the photograph.
  gpu->upload(s.soup.vertices.address(), std::vector<glm::vec3>{{0, -4, -2}, {0, 4, -2}, {0, 0, 5}});
  std::vector<float> lattice(soup::samples_at(4) * 8);
  soup::Random random(4);
  for (std::size_t i = 0; i < lattice.size(); ++i) lattice[i] = i % 8 == 7 ? 1.0f : random.uniform01();
  gpu->upload(s.soup.lattice.address(), lattice);
  gpu->upload(s.soup.opacity.address(), std::vector<float>(soup::samples_at(4), 1.0f));
  const auto bytes_of = [](const Picture& picture) {
    std::vector<std::uint32_t> rgba;
    for (std::size_t p = 0; p < picture.hits.size(); ++p) {
      std::uint32_t value = 0xff000000u;
      for (int c = 0; c < 3; ++c)
        value |= static_cast<std::uint32_t>(std::lround(255.0f * picture.colour[3 * p + c])) << (8 * c);
      rgba.push_back(value);
    }
    return rgba;
  };
  const gpu::Buffer photograph = upload(*gpu, bytes_of(picture_of(s, s.views[0])));
  train::BatchView view = s.views[0];
  view.photo = photograph.address();
  const auto difference = [&](glm::dvec2 soup_at, glm::dvec2 photograph_at) {
    const auto drawn = bytes_of(picture_of(s, train::sampled_at(view, soup_at)));
    const train::BatchView there = train::sampled_at(view, photograph_at);
    const auto target = targets(s, std::span(&there, 1));
    double sum = 0;
    for (std::uint32_t y = 2; y + 2 < kHeight; ++y)  // without the border, where the photograph ends
      for (std::uint32_t x = 2; x + 2 < kWidth; ++x)
        for (int c = 0; c < 3; ++c)
          sum += std::abs(channel(drawn[y * kWidth + x], c) - channel(target[y * kWidth + x], c));
    return sum / (3.0 * (kWidth - 4) * (kHeight - 4));
  };
  for (const glm::dvec2 at : {glm::dvec2(0.5, 0), {0, 0.5}, {-0.4, 0.3}, {0.9, -0.8}}) {
    CAPTURE(at.x, at.y);
    const double same = difference(at, at);
    CHECK(same < 0.5);  // both are rounded to 8 bits
    CHECK(difference(at, {0, 0}) > 1.5 * same);
    CHECK(difference(at, -at) > 2.5 * same);
  }
  test::require_silence(*gpu);
}

TEST_CASE("photographs are sampled with a cubic filter and give the same bits on all devices",
          "[jitter][each_driver]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kSizes[][2] = {{21, 17}, {3, 40}, {1, 1}};
  SmallScene s(*gpu, 3, {{0, 0}}, {test::view_from(0, 8, 8)});
  std::vector<gpu::Buffer> uploads;
  std::vector<std::vector<std::uint32_t>> photographs;
  std::vector<train::BatchView> centres, off;
  const glm::dvec2 offsets[] = {{0.2, -0.3}, {-0.875, 0.5}, {0.9, 0.01}};
  for (int v = 0; v < 3; ++v) {
    photographs.push_back(noise(kSizes[v][0], kSizes[v][1], 11 + v));
    uploads.push_back(upload(*gpu, photographs.back()));
    centres.push_back(test::view_from(0, kSizes[v][0], kSizes[v][1]));
    centres.back().photo = uploads.back().address();
    off.push_back(train::sampled_at(centres.back(), offsets[v]));
  }

  const auto unmoved = targets(s, centres), moved = targets(s, off);
  std::size_t first = 0;
  for (int v = 0; v < 3; ++v) {
    const int width = static_cast<int>(kSizes[v][0]), height = static_cast<int>(kSizes[v][1]);
    const auto& photograph = photographs[v];
    CHECK(std::equal(photograph.begin(), photograph.end(), unmoved.begin() + static_cast<std::ptrdiff_t>(first)));
    // Catmull-Rom spline through the values at -1, 0, 1 and 2, as a cubic polynomial in f.
    const auto spline = [](const double* p, double f) {
      return p[1] +
             0.5 * f *
                 (p[2] - p[0] + f * (2 * p[0] - 5 * p[1] + 4 * p[2] - p[3] + f * (3 * (p[1] - p[2]) + p[3] - p[0])));
    };
    const glm::dvec2 whole = glm::floor(offsets[v]), f = offsets[v] - whole;
    double worst = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c) {
          double rows[4];
          for (int j = 0; j < 4; ++j) {
            double row[4];
            for (int i = 0; i < 4; ++i) {
              const int px = std::clamp(x + int(whole.x) + i - 1, 0, width - 1),
                        py = std::clamp(y + int(whole.y) + j - 1, 0, height - 1);
              row[i] = channel(photograph[static_cast<std::size_t>(py * width + px)], c);
            }
            rows[j] = spline(row, f.x);
          }
          const double expected = std::clamp(spline(rows, f.y), 0.0, 255.0);
          worst =
              std::max(worst, std::abs(expected - channel(moved[first + static_cast<std::size_t>(y * width + x)], c)));
        }
    CAPTURE(v, worst);
    CHECK(worst < 4);  // weights are rounded to 1/128, half of it in each of two directions; noise of 8 bits
    first += photograph.size();
  }
  test::require_silence(*gpu);
}

TEST_CASE("sampling does not mix in pixels outside the mask", "[jitter]") {
  auto gpu = test::open_device();
  constexpr std::uint32_t kSide = 16;
  SmallScene s(*gpu, 3, {{0, 0}}, {test::view_from(0, kSide, kSide)});
  std::vector<std::uint32_t> photograph(kSide * kSide);
  for (std::uint32_t p = 0; p < photograph.size(); ++p)
    photograph[p] = p % kSide < 8 ? 0xff000000u | 0x010101u * (100 + p % 7) : 0x00ffffffu;
  const gpu::Buffer buffer = upload(*gpu, photograph);
  train::BatchView view = s.views[0];
  view.photo = buffer.address();
  const train::BatchView there = train::sampled_at(view, {0.4, 0.4});
  const auto target = targets(s, std::span(&there, 1));
  for (std::uint32_t p = 0; p < target.size(); ++p) {
    CAPTURE(p % kSide, p / kSide);
    const bool inside = p % kSide < 8;
    CHECK((target[p] >> 31) == (inside ? 1 : 0));
    if (inside) {
      CHECK(channel(target[p], 0) >= 99);
      CHECK(channel(target[p], 0) <= 107);
    }
    if (p % kSide == 6 || p % kSide == 7) CHECK(target[p] == photograph[p]);
  }
  // A uniform area stays exactly uniform, so that its blocks have no error and can be skipped.
  gpu->upload(buffer.address(), std::vector<std::uint32_t>(photograph.size(), 0xfffefdffu));
  CHECK(targets(s, std::span(&there, 1)) == std::vector<std::uint32_t>(photograph.size(), 0xfffefdffu));
  test::require_silence(*gpu);
}

TEST_CASE("sampling positions are spread evenly around pixel centres", "[jitter]") {
  const auto sized = [](std::uint32_t index, std::uint32_t width, std::uint32_t height) {
    train::BatchView view;
    view.index = index, view.width = width, view.height = height;
    return view;
  };
  std::set<std::pair<double, double>> different;
  glm::dvec2 sum(0.0), squares(0.0);
  double mixed = 0;
  int quarters[4] = {};
  constexpr int kSteps = 500, kViews = 8;
  for (std::uint64_t step = 0; step < kSteps; ++step)
    for (std::uint32_t index = 0; index < kViews; ++index) {
      const train::BatchView view = sized(index, 12, 9);
      const glm::dvec2 at = train::pixel_jitter(7, step, view, 0.25);
      REQUIRE(glm::all(glm::lessThanEqual(glm::abs(at), glm::dvec2(0.25))));
      CHECK(at == train::pixel_jitter(7, step, view, 0.25));
      different.insert({at.x, at.y});
      sum += at;
      squares += at * at;
      mixed += at.x * at.y;
      ++quarters[(at.x > 0) + 2 * (at.y > 0)];
    }
  constexpr double kDraws = kSteps * kViews, kVariance = 0.25 * 0.25 / 3;
  CHECK(different.size() > kDraws - 5);
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(std::abs(sum[axis] / kDraws) < 4 * std::sqrt(kVariance / kDraws));
    CHECK(squares[axis] / kDraws == Approx(kVariance).epsilon(0.06));
  }
  CHECK(std::abs(mixed / kDraws) < 4 * kVariance / std::sqrt(kDraws));
  for (const int n : quarters) CHECK(n == Approx(kDraws / 4).epsilon(0.1));
  const train::BatchView view = sized(2, 12, 9);
  CHECK(train::pixel_jitter(7, 3, view, 0.25) != train::pixel_jitter(8, 3, view, 0.25));
  CHECK(train::pixel_jitter(7, 3, view, 0) == glm::dvec2(0.0));
  CHECK(train::pixel_jitter(7, 3, sized(2, 1, 9), 0.25) == glm::dvec2(0.0, train::pixel_jitter(7, 3, view, 0.25).y));
  CHECK(train::pixel_jitter(7, 3, sized(2, 12, 1), 0.25) == glm::dvec2(train::pixel_jitter(7, 3, view, 0.25).x, 0.0));
}
