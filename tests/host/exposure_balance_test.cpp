// Tests engine/train/start/exposure_balance.h: gains of computed photographs that show the same places.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/host.h"
#include "soup/random.h"
#include "train/start/exposure_balance.h"

using namespace trisoup;

namespace {

using Places = std::vector<std::vector<train::SeenColour>>;

glm::vec3 true_gain(std::size_t photograph) {
  const float x = static_cast<float>(photograph);
  return {0.5f * std::sin(x), 0.4f * std::cos(2 * x), photograph == 7 ? -0.6f : 0.1f * std::sin(0.2f * x)};
}

/// Photographs of a walk along a street: a place is in `overlap` photographs, one after the other.
Places street(std::size_t photographs, std::size_t overlap, double wrong, double noise = 0) {
  soup::Random r(3);
  Places places;
  for (int i = 0; i < 3000; ++i) {
    const auto first = static_cast<std::size_t>(r.uniform(0, double(photographs - overlap + 1)));
    const glm::vec3 own(r.uniform(0.1, 0.9), r.uniform(0.1, 0.9), r.uniform(0.1, 0.9));
    std::vector<train::SeenColour>& place = places.emplace_back();
    for (std::size_t p = first; p < first + overlap; ++p) {
      glm::dvec3 c(f32::exposed({true_gain(p), 0}, own));
      if (r.uniform01() < wrong) c = {r.uniform(0.05, 0.95), r.uniform(0.05, 0.95), r.uniform(0.05, 0.95)};
      for (int k = 0; k < 3; ++k) c[k] = std::clamp(c[k] + r.uniform(-noise, noise), 0.01, 0.99);
      place.push_back({static_cast<std::uint32_t>(p), 2, c});
    }
  }
  return places;
}

/// Largest difference from the true gains without their mean.
double worst(const std::vector<glm::vec3>& gains) {
  glm::vec3 mean(0);
  for (std::size_t p = 0; p < gains.size(); ++p) mean += true_gain(p) / float(gains.size());
  double result = 0;
  for (const glm::vec3& gain : gains) REQUIRE(std::isfinite(gain.x + gain.y + gain.z));
  for (std::size_t p = 0; p < gains.size(); ++p)
    for (int c = 0; c < 3; ++c) result = std::max(result, double(std::abs(gains[p][c] - true_gain(p)[c] + mean[c])));
  return result;
}

}  // namespace

TEST_CASE("exposures are found along a street of which a photograph shows only a piece", "[exposure]") {
  CHECK(worst(train::balanced_gains(street(40, 2, 0), 40)) < 1e-4);
  CHECK(worst(train::balanced_gains(street(40, 4, 0), 40)) < 1e-4);
}

TEST_CASE("exposures are found although a fifth of the colours is of something else", "[exposure]") {
  CHECK(worst(train::balanced_gains(street(20, 6, 0.2, 0.02), 20)) < 0.1);
}

TEST_CASE("photographs that do not differ, or share nothing, have no exposures", "[exposure]") {
  const auto all_zero = [](const std::vector<glm::vec3>& gains) {
    return std::all_of(gains.begin(), gains.end(), [](const glm::vec3& g) { return glm::length(g) < 1e-6f; });
  };
  CHECK(train::balanced_gains({}, 0).empty());
  CHECK(all_zero(train::balanced_gains({}, 3)));
  CHECK(all_zero(train::balanced_gains({{{0, 1, glm::vec3(0.5f)}}}, 1)));
  // Equal colours in two pairs of photographs that share no place: rounding alone is left to solve for.
  soup::Random r(6);
  Places places;
  for (int i = 0; i < 200; ++i) {
    const auto first = static_cast<std::uint32_t>(i % 2 * 2);
    const glm::vec3 c(r.uniform(0.1, 0.9), r.uniform(0.1, 0.9), 0.5);
    places.push_back({{first, 1, c}, {first + 1, 1, c}});
  }
  const std::vector<glm::vec3> gains = train::balanced_gains(places, 5);
  REQUIRE(gains.size() == 5);
  CHECK(all_zero(gains));
  // Too few places say nothing.
  CHECK(all_zero(train::balanced_gains({{{0, 1, glm::vec3(0.4f)}, {1, 1, glm::vec3(0.6f)}}}, 2)));
}

TEST_CASE("exposures that places contradict are shrunk", "[exposure]") {
  // Half of the places say that the second photograph is brighter, half that it is darker, in equal parts.
  soup::Random r(7);
  Places places;
  for (int i = 0; i < 400; ++i) {
    const glm::vec3 c(r.uniform(0.3, 0.7));
    places.push_back({{0, 1, c}, {1, 1, f32::exposed({glm::vec3(i % 5 < 3 ? 0.5f : -0.5f), 0}, c)}});
  }
  const std::vector<glm::vec3> gains = train::balanced_gains(places, 2);
  CHECK(gains[1].x - gains[0].x > 0);
  CHECK(gains[1].x - gains[0].x < 0.24f);  // 0.29 if it were not shrunk
}
