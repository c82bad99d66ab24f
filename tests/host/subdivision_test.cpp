// Tests engine/soup/subdivision.h against the published implementation (golden D1..D4) and its own documentation.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

#include "npz.h"
#include "shared_data.h"
#include "soup/random.h"
#include "soup/subdivision.h"

using namespace trisoup;
using namespace trisoup::soup;

namespace {

// Converts indexed faces to a soup. Splits do not move vertices, so sharing them does not matter.
std::vector<glm::vec3> expand(const test::Array& vertices, const test::Array& faces) {
  std::vector<glm::vec3> out;
  for (const std::int32_t v : faces.i)
    out.emplace_back(vertices.f[3 * v], vertices.f[3 * v + 1], vertices.f[3 * v + 2]);
  return out;
}

glm::mat4 matrix(const test::Array& row_major, std::size_t index = 0) {
  glm::mat4 m;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) m[c][r] = row_major.f[16 * index + 4 * r + c];
  return m;
}

void check_equals_golden(const Subdivision& result, test::Npz& golden) {
  const std::vector<glm::vec3> expected = expand(golden["out_V"], golden["out_F"]);
  const std::vector<std::int32_t>& face_map = golden["face_map"].i;
  REQUIRE(result.triangles() == face_map.size());
  REQUIRE(result.vertices.size() == expected.size());
  REQUIRE(std::vector<std::int32_t>(result.face_map.begin(), result.face_map.end()) == face_map);
  CHECK(result.vertices == expected);  // exact, because ties in the order depend on it
  if (golden.count("same_as_original"))
    for (std::size_t t = 0; t < result.triangles(); ++t)
      CHECK((result.corners[t] == kWholeParent) == (golden["same_as_original"].i[t] != 0));
}

// Checks that the corners are the barycentrics of the vertices in the parent and that the parts tile it.
void check_corners(const Subdivision& result, const std::vector<glm::vec3>& parents, float tolerance = 1e-5f) {
  std::vector<double> area(parents.size() / 3, 0.0);
  for (std::size_t t = 0; t < result.triangles(); ++t) {
    const glm::vec3* p = &parents[3 * result.face_map[t]];
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 b = result.corners[t][k];
      const float scale = 1 + glm::length(p[0]) + glm::length(p[1]) + glm::length(p[2]);
      REQUIRE(glm::length(b.x * p[0] + b.y * p[1] + b.z * p[2] - result.vertices[3 * t + k]) <= tolerance * scale);
    }
    area[result.face_map[t]] +=
        glm::determinant(glm::mat3(result.corners[t][0], result.corners[t][1], result.corners[t][2]));
  }
  for (const double a : area) REQUIRE(a == Approx(1.0).margin(1e-4));
}

float longest_edge(const std::vector<glm::vec3>& v) {
  float longest = 0;
  for (std::size_t t = 0; t < v.size(); t += 3)
    for (int k = 0; k < 3; ++k) longest = std::max(longest, glm::distance(v[t + k], v[t + (k + 1) % 3]));
  return longest;
}

std::vector<glm::vec3> random_soup(std::size_t triangles, std::uint64_t seed) {
  Random random(seed);
  std::vector<glm::vec3> v(3 * triangles);
  for (glm::vec3& p : v) p = random.in_sphere();
  return v;
}

// Visible pixels per triangle at threshold 0.5 for opacity of level 0 (samples: corners 2, 0, 1), counted as in the
// published rasteriser.
std::vector<std::uint32_t> pixels_won(const std::vector<glm::vec3>& v, const std::vector<float>& alpha,
                                      const glm::mat4& clip, int width, int height) {
  std::vector<std::uint32_t> counts(v.size() / 3, 0);
  std::vector<glm::vec4> c;
  for (const glm::vec3& p : v) c.push_back(clip * glm::vec4(p, 1));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const glm::vec2 ndc(-1 + 2 * (x + 0.5f) / width, -1 + 2 * (y + 0.5f) / height);
      float nearest = 1.0f;
      std::size_t winner = counts.size();
      for (std::size_t t = 0; t < counts.size(); ++t) {
        if (c[3 * t].w <= 0 || c[3 * t + 1].w <= 0 || c[3 * t + 2].w <= 0) continue;
        glm::vec2 q[3];
        for (int k = 0; k < 3; ++k) q[k] = glm::vec2(c[3 * t + k]) - ndc * c[3 * t + k].w;
        const auto cross = [](glm::vec2 a, glm::vec2 b) { return a.x * b.y - a.y * b.x; };
        const float a0 = cross(q[1], q[2]), a1 = cross(q[2], q[0]), a = a0 + a1 + cross(q[0], q[1]);
        if (a == 0) continue;
        const float b0 = a0 / a, b1 = a1 / a, b2 = 1 - b0 - b1;
        if (b0 < 0 || b1 < 0 || b0 + b1 > 1) continue;
        const glm::vec4 at = b0 * c[3 * t] + b1 * c[3 * t + 1] + b2 * c[3 * t + 2];
        const float depth = at.z / at.w;
        const float* sample = &alpha[3 * t];
        if (depth <= -1 || depth >= nearest || b2 * sample[0] + b0 * sample[1] + b1 * sample[2] < 0.5f) continue;
        nearest = depth;
        winner = t;
      }
      if (winner < counts.size()) ++counts[winner];
    }
  return counts;
}

std::vector<std::uint32_t> consecutive(std::size_t n) {
  std::vector<std::uint32_t> v(n);
  for (std::size_t k = 0; k < n; ++k) v[k] = static_cast<std::uint32_t>(k);
  return v;
}

}  // namespace

TEST_CASE("bisecting longest world edges equals the published order", "[topology][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  for (const char* name : {"D1_split_world_count", "D1_split_world_shared", "D1_split_world_tau"}) {
    INFO(name);
    test::Npz golden = test::load_npz(shared / "golden" / (std::string(name) + ".npz"));
    const std::vector<glm::vec3> soup = expand(golden["V"], golden["F"]);
    const int splits = golden["num_splits"].i[0];
    const Subdivision result = splits >= 0 ? bisect_longest(soup, soup.size() / 3 + static_cast<std::size_t>(splits))
                                           : bisect_longer_than(soup, golden["tau"].f[0]);
    check_equals_golden(result, golden);
    check_corners(result, soup);
  }
}

TEST_CASE("bisecting screen edges of one view equals the published order", "[topology][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  for (const char* name : {"D2_split_clip", "D2_split_clip_cap15"}) {
    INFO(name);
    test::Npz golden = test::load_npz(shared / "golden" / (std::string(name) + ".npz"));
    const std::vector<glm::vec3> soup = expand(golden["V"], golden["F"]);
    const ScreenView view{matrix(golden["mvp"]), golden["W"].i[0], golden["H"].i[0]};
    const std::vector<std::uint8_t> marked(golden["valid_faces"].i.begin(), golden["valid_faces"].i.end());
    std::optional<std::size_t> cap;
    if (golden.count("num_splits")) cap = golden["num_splits"].i[0];
    const Subdivision result = bisect_on_screen(soup, view, golden["tau_ratio"].f[0], marked, cap);
    check_equals_golden(result, golden);
    check_corners(result, soup);
  }
}

TEST_CASE("the composite over training views equals the published one", "[topology][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  test::Npz golden = test::load_npz(shared / "golden/D3_split_training_views.npz");
  const std::vector<glm::vec3> soup = expand(golden["V"], golden["F"]);
  std::vector<ScreenView> views;
  for (std::size_t k = 0; k < 5; ++k) views.push_back({matrix(golden["mvps"], k), golden["W"].i[0], golden["H"].i[0]});
  std::vector<std::vector<std::uint8_t>> visible;
  for (const ScreenView& view : views) {
    visible.emplace_back();
    for (const std::uint32_t count : pixels_won(soup, golden["alpha_acc"].f, view.clip, view.width, view.height))
      visible.back().push_back(count > 0);
  }
  const Subdivision result = bisect_on_screens(soup, views, golden["tau_ratio"].f[0], visible);
  check_equals_golden(result, golden);
  check_corners(result, soup, 3e-5f);

  const Subdivision capped = bisect_on_screens(soup, views, golden["tau_ratio"].f[0], visible, 7);
  CHECK(capped.triangles() == soup.size() / 3 + 7);
}

TEST_CASE("dropping by visibility equals the published choice", "[topology][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  test::Npz golden = test::load_npz(shared / "golden/D4_visibility.npz");
  const std::vector<glm::vec3> soup = expand(golden["V"], golden["F"]);
  const std::vector<std::uint32_t> counts(golden["counts"].i.begin(), golden["counts"].i.end());

  std::vector<std::uint32_t> own(counts.size(), 0);
  for (std::size_t k = 0; k < 5; ++k) {
    const auto won =
        pixels_won(soup, golden["alpha_acc"].f, matrix(golden["mvps"], k), golden["W"].i[0], golden["H"].i[0]);
    for (std::size_t t = 0; t < counts.size(); ++t) own[t] += won[t];
  }
  CHECK(own == counts);

  const auto same = [](const std::vector<std::uint32_t>& a, const std::vector<std::int32_t>& b) {
    return std::vector<std::int32_t>(a.begin(), a.end()) == b;
  };
  const std::vector<std::uint32_t> kept = most_visible(counts, counts.size() - golden["remove"].i[0]);
  CHECK(same(kept, golden["keep_remove"].i));
  CHECK(same(visible_at_least(counts, 1), golden["keep_thresh1"].i));
  CHECK(keep(soup, kept).vertices == expand(golden["kept_V"], golden["kept_F"]));
}

TEST_CASE("of equally visible triangles the later ones are kept", "[topology]") {
  const std::vector<std::uint32_t> counts{5, 0, 3, 0, 3, 9};
  CHECK(most_visible(counts, 4) == std::vector<std::uint32_t>{0, 2, 4, 5});
  CHECK(most_visible(counts, 3) == std::vector<std::uint32_t>{0, 4, 5});
  CHECK(most_visible(counts, 5) == std::vector<std::uint32_t>{0, 2, 3, 4, 5});
  CHECK(most_visible(counts, 6) == consecutive(6));
  CHECK(most_visible(counts, 100) == consecutive(6));
  CHECK(most_visible(counts, 0).empty());
  CHECK(visible_at_least(counts) == std::vector<std::uint32_t>{0, 2, 4, 5});
}

TEST_CASE("a bisection gives (a, m, c) in place and (m, b, c) at the end", "[topology]") {
  const std::vector<glm::vec3> soup{{9, 9, 9}, {9, 9, 9}, {9, 9, 9}, {0, 1, 0}, {0, 0, 0}, {4, 0, 0}};
  const Subdivision result = bisect_longest(soup, 3);  // the longest edge is (v2, v0)
  const std::vector<glm::vec3> expected{{9, 9, 9}, {9, 9, 9},    {9, 9, 9}, {4, 0, 0}, {2, 0.5f, 0},
                                        {0, 0, 0}, {2, 0.5f, 0}, {0, 1, 0}, {0, 0, 0}};
  CHECK(result.vertices == expected);
  CHECK(result.face_map == std::vector<std::uint32_t>{0, 1, 1});
  CHECK(result.corners[0] == kWholeParent);
  CHECK(result.corners[1] == Corners{glm::vec3{0, 0, 1}, glm::vec3{0.5f, 0, 0.5f}, glm::vec3{0, 1, 0}});
  CHECK(result.corners[2] == Corners{glm::vec3{0.5f, 0, 0.5f}, glm::vec3{1, 0, 0}, glm::vec3{0, 1, 0}});
}

TEST_CASE("bisection reaches its target and keeps winding, area and barycentrics", "[topology]") {
  const std::vector<glm::vec3> soup = random_soup(40, 1);
  const Subdivision by_count = bisect_longest(soup, 1000);
  CHECK(by_count.triangles() == 1000);
  check_corners(by_count, soup);
  const Subdivision by_length = bisect_longer_than(soup, 0.25f);
  CHECK(longest_edge(by_length.vertices) <= 0.25f);
  check_corners(by_length, soup);
  CHECK(bisect_longer_than(soup, 0.25f, 10).triangles() == 50);
  CHECK(bisect_longest(soup, 7).vertices == soup);
  CHECK(bisect_longest({}, 7).triangles() == 0);
}

TEST_CASE("the largest triangles are bisected, until their halves would be too small", "[topology]") {
  std::vector<glm::vec3> three;
  for (const float x : {0.0f, 10.0f, 20.0f}) three.insert(three.end(), {{x, 0, 0}, {x + 2, 0, 0}, {x, 1, 0}});
  const auto count = [](const Subdivision& r, std::uint32_t face) {
    return std::count(r.face_map.begin(), r.face_map.end(), face);
  };
  // The given sizes count, not the lengths. 80 becomes four of 20, 30 becomes two of 15, then one of the 20 becomes two
  // of 10.
  const std::vector<double> sizes{30, 0, 80};
  const Subdivision split = bisect_largest(three, sizes, 1, 8);
  REQUIRE(split.triangles() == 8);
  CHECK(count(split, 0) == 2);
  CHECK(count(split, 1) == 1);
  CHECK(count(split, 2) == 5);
  check_corners(split, three);
  CHECK(split.corners[1] == kWholeParent);
  // The longest edge, from (22, 0) to (20, 1), is split.
  CHECK(bisect_largest(three, sizes, 1, 4).vertices[7] == glm::vec3(21, 0.5, 0));
  // With a minimum of 20, 80 is split into four parts and 30 not at all.
  const Subdivision few = bisect_largest(three, sizes, 20, 100);
  CHECK(few.triangles() == 6);
  CHECK(count(few, 2) == 4);
  CHECK(bisect_largest(three, std::vector<double>{0, NAN, INFINITY}, 1, 100).triangles() == 3);
  CHECK(bisect_largest(three, sizes, 1, 2).triangles() == 3);
  const std::vector<glm::vec3> point(3, glm::vec3(1));
  CHECK(bisect_largest(point, std::vector<double>{100}, 1, 100).triangles() == 1);
}

TEST_CASE("bisection ends on triangles that cannot be bisected", "[topology]") {
  const float inf = INFINITY, nan = NAN;
  CHECK(bisect_longest(std::vector<glm::vec3>(3, glm::vec3(1)), 10).triangles() == 1);
  const std::vector<glm::vec3> broken{{inf, 0, 0}, {0, 0, 0}, {0, 1, 0}, {nan, 0, 0}, {0, nan, 0}, {1, 0, 0}};
  const Subdivision result = bisect_longer_than(broken, 0.3f);
  CHECK(result.triangles() < 20);
  CHECK(result.triangles() > 2);  // finite edges are still split
}

TEST_CASE("screen bisection skips triangles that are unmarked, out of view or behind the camera", "[topology]") {
  glm::mat4 clip(0.0f);  // looks along +z, field of view 90 degrees, near 0.1, far 10
  clip[0][0] = clip[1][1] = 1, clip[2][2] = 10.1f / 9.9f, clip[2][3] = 1, clip[3][2] = -2.0f / 9.9f;
  const ScreenView view{clip, 100, 100};
  const std::vector<glm::vec3> inside{{-0.9f, -0.9f, 1}, {3, -3, 4}, {-0.5f, 0.9f, 1}};
  const Subdivision result = bisect_on_screen(inside, view, 0.2f);
  CHECK(result.triangles() > 10);
  check_corners(result, inside);
  for (std::size_t t = 0; t < result.triangles(); ++t)
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 p = result.vertices[3 * t + k], q = result.vertices[3 * t + (k + 1) % 3];
      CHECK(std::hypot(p.x / p.z - q.x / q.z, p.y / p.z - q.y / q.z) <= 0.4001f);
    }
  CHECK(bisect_on_screen(inside, view, 0.2f, std::vector<std::uint8_t>{0}).triangles() == 1);
  CHECK(bisect_on_screen(inside, view, 0.2f, {}, 3).triangles() == 4);
  CHECK(bisect_on_screen(std::vector<glm::vec3>{{0, 0, -1}, {1, 0, -1}, {0, 1, -1}}, view, 0.2f).triangles() == 1);
  CHECK(bisect_on_screen(std::vector<glm::vec3>{{2, 0, 1}, {3, 0, 1}, {2, 2, 1}}, view, 0.2f).triangles() == 1);
}

TEST_CASE("the composition of two refinements is one refinement", "[topology]") {
  const std::vector<glm::vec3> soup = random_soup(10, 2);
  const Subdivision split = bisect_longest(soup, 30);
  const Subdivision again = compose(split, bisect_longest(split.vertices, 70));
  CHECK(again.triangles() == 70);
  check_corners(again, soup);
  const std::vector<std::uint32_t> kept{3, 5, 28};
  const Subdivision dropped = compose(split, keep(split.vertices, kept));
  CHECK(dropped.face_map == std::vector<std::uint32_t>{split.face_map[3], split.face_map[5], split.face_map[28]});
  CHECK(dropped.corners[2] == split.corners[28]);
}
