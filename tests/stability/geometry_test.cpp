// Stability of projection, coverage and edge forces (shaders/project.comp, common/coverage.h, common/edges.h) for
// degenerate triangles: pictures match double precision, gradients are bounded, and a step leaves every parameter
// finite.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <tuple>

#include "stability/reference_picture.h"
#include "train/step/non_finite.h"

using namespace trisoup;
using test::SmallScene;

namespace {

constexpr std::uint32_t kWidth = 52, kHeight = 44;
constexpr double kNear = 0.025, kFar = 10;

/// A camera at the origin that looks along z, with x to the right and y down, so that w is exactly z.
train::BatchView forward_view() {
  scene::Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 1.0 * kWidth;
  camera.cx = 0.5 * kWidth;
  camera.cy = 0.5 * kHeight;
  return train::batch_view(camera, kNear, kFar);
}

using Vertices = std::vector<glm::vec3>;

/// A scene that is opaque at threshold 0.5, with level 0.
struct OpaqueScene : SmallScene {
  OpaqueScene(gpu::Device& device, const Vertices& vertices)
      : SmallScene(device, static_cast<std::uint32_t>(vertices.size() / 3), {{0, 0}}, {forward_view()}) {
    buffers.reserve_lists(
        std::min<std::uint64_t>(1u << 20, std::uint64_t(soup.triangles + 64) * buffers.batch().tiles));
    for (std::size_t i = 7; i < logits.size(); i += 8) logits[i] = 5.0f;
    gpu.upload(soup.source.address(), logits);
    gpu.upload(soup.vertices.address(), vertices);
    step.sum_textures();
  }
};

std::vector<std::uint32_t> picture(SmallScene& s) {
  s.step.begin(1, 0, 0, {});
  s.step.visibility(train::Thresholds::half, s.inputs);
  REQUIRE_FALSE(train::grow_lists_if_needed(s.gpu, s.buffers));
  std::vector<std::uint32_t> shown;
  for (const kernels::Hit& hit :
       s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.buffers.batch().pixels)) {
    REQUIRE((std::isfinite(hit.b0) && std::isfinite(hit.b1) && std::isfinite(hit.depth)));
    shown.push_back(hit.triangle);
  }
  return shown;
}

/// Trains some steps with random targets and checks that gradients are bounded and everything is finite.
void check_training(SmallScene& s) {
  const gpu::Buffer seen = s.gpu.allocate(s.soup.triangles * 36ull, "vertex gradient");
  s.inputs.probes.vertex_gradient = seen.address();
  s.inputs.opacity_baseline = true;
  for (std::uint32_t i = 0; i < 4; ++i) {
    s.train(i, SmallScene::rates(i));
    const auto gradient = s.gpu.download_vector<float>(seen.address(), s.soup.triangles * 9ull);
    // Moving a corner moves the picture by at most 2 / near in NDC per unit, and the mean error changes by a few times
    // the picture's height at most.
    const double bound = 5 / kNear;
    double largest = 0;
    for (const float g : gradient) largest = std::max(largest, std::isfinite(g) ? double(std::abs(g)) : INFINITY);
    CAPTURE(i);
    CHECK(largest <= bound);
  }
  s.inputs.probes.vertex_gradient = 0;
  const auto state = s.state();
  CHECK(std::all_of(state.begin(), state.end(), [](float v) { return std::isfinite(v); }));
  CHECK(train::take_non_finite(s.gpu, s.soup, s.buffers).empty());
  const auto colour = s.gpu.download_vector<float>(s.buffers.colour.address(), 3ull * s.buffers.batch().pixels);
  CHECK(std::all_of(colour.begin(), colour.end(), [](float v) { return v >= 0 && v <= 1; }));
}

struct Tally {
  std::size_t pixels = 0, covered = 0, ties = 0, wrong = 0, astray = 0;
};

/// Tests random scenes. No pixel except ties may show another triangle than the reference. With exact = false, float is
/// not precise enough; then no pixel may show a triangle more than one and a half pixels away.
Tally check_family(int scenes, const std::function<Vertices(soup::Random&)>& make, bool exact = true) {
#ifdef TRISOUP_SANITIZED
  scenes = std::min(scenes, 2);  // all run the same code, for half a second each
#endif
  auto gpu = test::open_device();
  Tally all;
  for (int n = 0; n < scenes; ++n) {
    soup::Random random(100 + static_cast<std::uint64_t>(n));
    const Vertices vertices = make(random);
    OpaqueScene s(*gpu, vertices);
    const auto shown = picture(s);
    const auto right = test::reference_picture(vertices, s.views[0]);
    for (std::size_t p = 0; p < shown.size(); ++p) {
      ++all.pixels;
      all.covered += right[p].triangle != 0;
      all.ties += right[p].tie;
      if (shown[p] != 0 && !right[p].tie)
        all.astray += !test::near_by(vertices, s.views[0], shown[p] - 1, static_cast<std::uint32_t>(p % kWidth),
                                     static_cast<std::uint32_t>(p / kWidth));
      if (!right[p].tie && shown[p] != right[p].triangle) {
        if (all.wrong++ < 5)
          UNSCOPED_INFO("scene " << n << ", pixel " << p % kWidth << " " << p / kWidth << ": " << shown[p] << " for "
                                 << right[p].triangle);
      }
    }
    check_training(s);
  }
  UNSCOPED_INFO(all.pixels << " pixels, " << all.covered << " covered, " << all.ties << " ties, " << all.wrong
                           << " wrong, " << all.astray << " astray");
  CHECK(all.astray == 0);
  if (exact) CHECK(all.wrong == 0);
  test::require_silence(*gpu);
  return all;
}

glm::vec3 in_view(soup::Random& r, float depth_low = 0.5f, float depth_high = 3.0f) {
  const float z = r.uniform(depth_low, depth_high);
  return {z * r.uniform(-0.5f, 0.5f), z * r.uniform(-0.42f, 0.42f), z};
}

/// `count` random triangles, each `copies` times.
Vertices triangles_in_view(soup::Random& r, int count, int copies = 1) {
  Vertices v;
  for (int i = 0; i < count; ++i) {
    const glm::vec3 a = in_view(r), b = in_view(r), c = in_view(r);
    for (int k = 0; k < copies; ++k) v.insert(v.end(), {a, b, c});
  }
  return v;
}

glm::vec3 direction(soup::Random& r) {
  return glm::normalize(glm::vec3{r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(-1, 1)});
}

}  // namespace

TEST_CASE("slivers are visible only where they are", "[geometry]") {
  // Aspect 1e6: thinner than a pixel; one pixel wide, but 50,000 units long. Aspect 1e3: visible, inside the scene.
  const auto [length, width, exact] =
      GENERATE(std::tuple(0.5f, 5e-7f, true), std::tuple(5e4f, 0.05f, false), std::tuple(20.0f, 0.02f, true));
  CAPTURE(length, width);
  const Tally t = check_family(
      12,
      [length = length, width = width](soup::Random& r) {
        Vertices v;
        for (int i = 0; i < 30; ++i) {
          const glm::vec3 a = in_view(r), along = direction(r),
                          across = glm::normalize(glm::cross(along, direction(r)));
          v.insert(v.end(),
                   {a - 0.3f * length * along, a + 0.7f * length * along, a + 0.5f * length * along + width * across});
        }
        return v;
      },
      exact);
  if (width > 1e-3f) CHECK(t.covered > t.pixels / 100);
}

TEST_CASE("triangles without area cover nothing", "[geometry]") {
  auto gpu = test::open_device();
  soup::Random r(3);
  Vertices ordinary, with;
  for (int i = 0; i < 10; ++i) {
    const glm::vec3 a = in_view(r), b = in_view(r), c = in_view(r);
    ordinary.insert(ordinary.end(), {a, b, c});
  }
  with = ordinary;
  for (int i = 0; i < 30; ++i) {
    const glm::vec3 a = in_view(r), b = in_view(r);
    if (i % 3 == 0)
      with.insert(with.end(), {a, a, a});
    else if (i % 3 == 1)
      with.insert(with.end(), {a, b, i % 2 ? a : b});
    else {
      // Three exactly collinear points: multiples of a power of two of each other.
      const glm::vec3 step = glm::round(256.0f * direction(r)) / 256.0f, start = glm::round(256.0f * a) / 256.0f;
      with.insert(with.end(), {start, start + step, start + 2.0f * step});
    }
  }
  OpaqueScene few(*gpu, ordinary), all(*gpu, with);
  CHECK(picture(few) == picture(all));
  check_training(all);
  test::require_silence(*gpu);
}

TEST_CASE("triangles smaller than a pixel are visible where they cover its centre", "[geometry]") {
  const Tally t = check_family(3, [](soup::Random& r) {
    Vertices v;
    for (int i = 0; i < 1500; ++i) {
      const glm::vec3 a = in_view(r);
      const float size = a.z / kWidth * r.uniform(0.1f, 0.9f);
      v.insert(v.end(), {a, a + size * direction(r), a + size * direction(r)});
    }
    return v;
  });
  CHECK(t.covered > t.pixels / 50);
}

TEST_CASE("triangles much larger than the picture cover all of it", "[geometry]") {
  for (const float size : {2.0f, 100.0f, 1e3f, 1e4f, 1e6f}) {
    CAPTURE(size);
    const Tally t = check_family(
        4,
        [&](soup::Random& r) {
          Vertices v;
          for (int i = 0; i < 6; ++i) {
            const glm::vec3 a = in_view(r), along = direction(r),
                            across = glm::normalize(glm::cross(along, direction(r)));
            v.insert(v.end(), {a - size * along - 0.6f * size * across, a + size * along - 0.6f * size * across,
                               a + 1.2f * size * across});
          }
          return v;
        },
        size < 500.0f);
    CHECK(t.covered > t.pixels / 2);
  }
}

TEST_CASE("of coincident triangles the first is visible", "[geometry]") {
  auto gpu = test::open_device();
  soup::Random r(6);
  const Vertices v = triangles_in_view(r, 8, 3);
  OpaqueScene s(*gpu, v);
  const auto shown = picture(s);
  std::size_t covered = 0;
  for (const std::uint32_t t : shown) {
    covered += t != 0;
    CHECK((t == 0 || (t - 1) % 3 == 0));
  }
  CHECK(covered > shown.size() / 10);
  check_training(s);
  test::require_silence(*gpu);
}

TEST_CASE("intersecting triangles show the nearer one", "[geometry]") {
  const Tally t = check_family(6, [](soup::Random& r) {
    Vertices v;
    // Some are nearly parallel, so that the line of intersection moves far with a tiny motion.
    const glm::vec3 centre{0, 0, 1.5f};
    for (int i = 0; i < 12; ++i) {
      const float tilt = i % 2 ? 1.0f : 1e-3f;
      for (int k = 0; k < 3; ++k) {
        const float angle = 2.1f * static_cast<float>(k) + r.uniform(-0.3f, 0.3f);
        v.push_back(centre + glm::vec3(std::cos(angle), std::sin(angle), tilt * r.uniform(-0.5f, 0.5f)));
      }
    }
    return v;
  });
  CHECK(t.covered > t.pixels / 2);
}

TEST_CASE("triangles with vertices on or behind the camera plane are visible beyond the near plane", "[geometry]") {
  const Tally t = check_family(24, [](soup::Random& r) {
    Vertices v;
    for (int i = 0; i < 16; ++i) {
      glm::vec3 corner[3] = {in_view(r), in_view(r), in_view(r)};
      const float side = r.uniform01() < 0.5f ? -1.0f : 1.0f;
      switch (i % 8) {
        case 0:
          corner[0] = {side * r.uniform(0.0f, 2.0f), r.uniform(-2, 2), 0.0f};
          break;  // on the camera plane, w = 0
        case 1:
          corner[0] = glm::vec3(0.0f);
          break;  // the camera position
        case 2:
          corner[0] = {r.uniform(-3, 3), r.uniform(-3, 3), r.uniform(-4.0f, -0.01f)};
          break;  // one corner behind
        case 3:   // two corners behind
          for (int k = 0; k < 2; ++k) corner[k] = {r.uniform(-3, 3), r.uniform(-3, 3), r.uniform(-4.0f, -0.01f)};
          break;
        case 4:
          corner[0] = {r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(0.0f, 0.025f)};
          break;  // between camera and near plane
        case 5:
          corner[0] = corner[1] = {0.5f, 0.5f, 0.0f};
          corner[1].x = -0.5f;
          break;  // an edge on the camera plane
        case 6:   // the ground, far behind the camera
          corner[0] = {-40, 0.3f, -30}, corner[1] = {40, 0.3f, -30},
          corner[2] = {r.uniform(-9, 9), r.uniform(0.3f, 0.6f), 60};
          break;
        default:  // all corners behind: never visible
          for (glm::vec3& c : corner) c.z = -c.z;
      }
      v.insert(v.end(), corner, corner + 3);
    }
    return v;
  });
  CHECK(t.covered > t.pixels / 2);
}

TEST_CASE("dropping as published and clipping differ only in the triangles that cross the camera plane", "[geometry]") {
  auto gpu = test::open_device();
  const Vertices v{{-40, 0.3f, -30}, {40, 0.3f, -30}, {0, 0.3f, 60}, {-0.2f, -0.2f, 2}, {0.2f, -0.2f, 2}, {0, 0.1f, 2}};
  OpaqueScene s(*gpu, v);
  const auto clipped = picture(s);
  s.soup.drop_near = true;
  const auto dropped = picture(s);
  std::size_t ground = 0, other = 0;
  for (std::size_t p = 0; p < clipped.size(); ++p) {
    ground += clipped[p] == 1;
    other += clipped[p] == 2;
    CHECK(dropped[p] == (clipped[p] == 1 ? 0 : clipped[p]));
  }
  CHECK(ground > clipped.size() / 5);
  CHECK(other > 10);
  test::require_silence(*gpu);
}

TEST_CASE("a million triangles off the screen do not change the picture", "[geometry][slow]") {
  auto gpu = test::open_device();
  soup::Random r(8);
  const Vertices few = triangles_in_view(r, 10);
  Vertices many = few;
  for (int i = 0; i < 1'000'000; ++i) {
    glm::vec3 a{r.uniform(-9, 9), r.uniform(-9, 9), r.uniform(-9, 9)};
    if (i % 3 == 0)
      a.z = -0.5f - std::abs(a.z);
    else if (i % 3 == 1)
      a.x = (a.x < 0 ? -1.0f : 1.0f) * (2.0f + std::abs(a.z));
    else
      a.z = 11.0f + std::abs(a.z);
    many.insert(many.end(), {a, a + 0.3f * direction(r), a + 0.3f * direction(r)});
  }
  OpaqueScene one(*gpu, few), all(*gpu, many);
  CHECK(picture(one) == picture(all));
  const auto control = gpu->download_vector<kernels::Control>(all.buffers.control.address(), 1)[0];
  CHECK(control.list_total < 10 * all.buffers.batch().tiles);  // no tile's list contains any of the million
  all.train(0, SmallScene::rates(0));
  const auto after = gpu->download_vector<glm::vec3>(all.soup.vertices.address(), many.size());
  std::size_t moved = 0;
  for (std::size_t i = 30; i < many.size(); ++i) moved += after[i] != many[i];
  CHECK(moved == 0);
  test::require_silence(*gpu);
}
